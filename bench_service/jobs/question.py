"""A question that may go without an answer for long, asked in a thread of its own: whoever asks goes on meanwhile.

For a database that hangs: it neither answers nor refuses, and no time limit of its driver helps while the server's
kernel still takes what is sent.
"""

from collections.abc import Callable
from concurrent.futures import Future, wait
from typing import Generic, TypeVar

from bench_service.jobs.background import in_background

T = TypeVar("T")


class Question(Generic[T]):
    """One question, never asked a second time before the first is answered. One thread uses it."""

    def __init__(self, name: str, question: Callable[[], T]) -> None:
        self._name = name
        self._question = question
        self._asked: Future[T] | None = None

    def ask(self, within_s: float) -> T | None:
        """The answer; None where it does not come within so long [s], and is waited for at the next call.

        Raises what the question raises.
        """
        if self._asked is None:
            self._asked = in_background(self._name, self._question)
        asked = self._asked
        if not wait((asked,), within_s).done:
            return None
        self._asked = None
        return asked.result()
