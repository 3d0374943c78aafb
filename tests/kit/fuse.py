"""A process that dies at a chosen call into its environment: work is wrapped, and the n-th call kills it."""

from collections.abc import Callable
from typing import Any

from bench_service.persistence import Database


class Killed(BaseException):
    """The process was killed by its fuse."""


class Fuse:
    """Kills the process at its n-th touch of the world, once; after one touch is before the next."""

    def __init__(self, at: int) -> None:
        self.left, self.blown = at, False

    def around(self, work: Callable[..., Any]) -> Callable[..., Any]:
        def guarded(*given: Any, **named: Any) -> Any:
            self.left -= 1
            if self.left == 0:
                self.blown = True
                raise Killed
            return work(*given, **named)

        return guarded


def positions(database: Database) -> range:
    """Every touch on SQLite, every third on Postgres: the decisions are the same, only the row's lock is another."""
    return range(1, 60, 3 if database.is_postgres else 1)
