"""Long lists in parts: a statement holds only so many values."""

from collections.abc import Iterator, Sequence
from typing import TypeVar

T = TypeVar("T")

AT_ONCE = 500
"""Values in one statement: below what SQLite and Postgres take with several columns a row."""


def in_parts(items: Sequence[T]) -> Iterator[Sequence[T]]:
    """The items in order, `AT_ONCE` together."""
    return (items[first : first + AT_ONCE] for first in range(0, len(items), AT_ONCE))
