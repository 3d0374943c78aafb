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
    """Pool of processes in which parts of an analysis run at the same time. Interface; the service implements it."""

    @property
    def width(self) -> int:
        """Number of parts that run at one time, at least 2."""
        ...

    def each(self, work: Callable[[A], R], items: Sequence[A]) -> list[R]:
        """Run `work`, a function of a module, on each item at the same time; wait, and return the results in order.

        Raises the error of the first item that has one. Items and results are copied: what `work` changes in an item is
        lost.
        """
        ...


_SPREAD: ContextVar[Spread | None] = ContextVar("spread", default=None)


def width() -> int:
    """Return the number of parts that are computed at one time: 1 where no pool was provided."""
    spread = _SPREAD.get()
    return 1 if spread is None else spread.width


def each(work: Callable[[A], R], items: Sequence[A]) -> list[R]:
    """Return the results of `work` on each item, in order, computed in the pool of `spread_over` or here; see
    `Spread.each`.
    """
    spread = _SPREAD.get()
    return [work(item) for item in items] if spread is None or len(items) < 2 else spread.each(work, items)


@contextmanager
def spread_over(spread: Spread | None) -> Generator[None]:
    """Run the block so that parts of analyses of this thread are computed in that pool; None: in this thread."""
    token = _SPREAD.set(spread)
    try:
        yield
    finally:
        _SPREAD.reset(token)
