"""Splitting of long lists for SQL: a statement holds only so many values."""

from collections.abc import Iterator, Sequence
from typing import TypeVar

T = TypeVar("T")

AT_ONCE = 500
"""Values in one statement: below what SQLite and Postgres take with several columns a row."""


def in_parts(items: Sequence[T]) -> Iterator[Sequence[T]]:
    """Yield the items in order, in slices of at most `AT_ONCE`."""
    return (items[first : first + AT_ONCE] for first in range(0, len(items), AT_ONCE))
