"""Independent parts of an analysis: one after another, or at the same time where the caller provides for it.

An analysis names its parts; it does not know processes. The result does not depend on how they are worked out.
"""

from collections.abc import Callable, Generator, Sequence
from contextlib import contextmanager
from contextvars import ContextVar
from typing import Protocol, TypeVar

A = TypeVar("A")
R = TypeVar("R")


class Spread(Protocol):
    """Pool of processes in which parts of an analysis run at the same time."""

    @property
    def width(self) -> int:
        """Number of parts at one time, at least 2."""
        ...

    def each(self, work: Callable[[A], R], items: Sequence[A]) -> list[R]:
        """The results of `work`, a function of a module, on each item, in order. Raises the error of the first item
        that has one. Items and results are copied: what `work` changes in an item is lost.
        """
        ...


_SPREAD: ContextVar[Spread | None] = ContextVar("spread", default=None)


def width() -> int:
    """Number of parts that are worked out at one time: 1 where nothing was provided."""
    spread = _SPREAD.get()
    return 1 if spread is None else spread.width


def each(work: Callable[[A], R], items: Sequence[A]) -> list[R]:
    """The results of `work` on each item, in order; see `Spread.each`."""
    spread = _SPREAD.get()
    return [work(item) for item in items] if spread is None or len(items) < 2 else spread.each(work, items)


@contextmanager
def spread_over(spread: Spread | None) -> Generator[None]:
    """Inside the block the parts of analyses of this thread are worked out there; None: here."""
    token = _SPREAD.set(spread)
    try:
        yield
    finally:
        _SPREAD.reset(token)
