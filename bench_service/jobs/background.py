"""Work in a thread that the process does not wait for at its end, as it would for an executor's."""

from collections.abc import Callable
from concurrent.futures import Future
from contextvars import copy_context
from threading import Thread
from typing import TypeVar

T = TypeVar("T")


def in_background(name: str, work: Callable[[], T]) -> "Future[T]":
    """What `work` gives or raises, once it does; lines of the log are about the same things as the caller's."""
    outcome: Future[T] = Future()

    def run() -> None:
        try:
            outcome.set_result(work())
        except BaseException as failure:  # raised again where the outcome is asked for
            outcome.set_exception(failure)

    Thread(target=copy_context().run, args=(run,), name=name, daemon=True).start()
    return outcome
