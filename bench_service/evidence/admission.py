"""Admission control of memory-heavy HTTP requests: at most so many at a time, within so much memory; others wait or are
refused. Not the check of a job: that is `bench_service.jobs.service`.
"""

from collections.abc import Callable
from pathlib import Path
from threading import Lock
from typing import Any

from anyio import CapacityLimiter, to_thread

from bench_service.model.errors import Overloaded

SPARE_BYTES = 256_000_000
"""Memory of the machine that heavy requests leave to driving the bench [bytes]."""
_MEMORY = Path("/proc/meminfo")


def available_bytes() -> int | None:
    """Read how much memory the machine can give without swapping [bytes]; None where the system does not say."""
    try:
        for line in _MEMORY.read_text(encoding="ascii").splitlines():
            if line.startswith("MemAvailable:"):
                return int(line.split()[1]) * 1024
    except (OSError, ValueError, IndexError):
        return None
    return None


class Places:
    """A limited number of places and bytes of memory for requests, each held while its request lasts. For any
    thread.
    """

    def __init__(self, what: str, most: int, most_bytes: int) -> None:
        """Set up for at most `most` requests at a time, with `most_bytes` of memory together.

        `what`: the requests in the plural, for the refusal.
        """
        self._what = what
        self._most = most
        self._most_bytes = most_bytes
        self._mutex = Lock()
        self._taken: list[int] = []

    def take(self, wanted_bytes: int) -> Callable[[], None]:
        """Take a place; return the function that gives it back, once however often it is called.

        A request that alone wants more than there is gets its place where no other has one. Raises `Overloaded`.
        """
        with self._mutex:
            full = len(self._taken) >= self._most
            heavy = bool(self._taken) and sum(self._taken) + wanted_bytes > self._most_bytes
            if full or heavy:
                raise Overloaded(f"{len(self._taken)} {self._what} are running already: try again later")
            available = available_bytes()
            if available is not None and available < SPARE_BYTES + wanted_bytes:
                raise Overloaded(f"the machine has too little free memory for {self._what}: try again later")
            self._taken.append(wanted_bytes)
        given_back = [False]

        def give_back() -> None:
            with self._mutex:
                if not given_back[0]:
                    given_back[0] = True
                    self._taken.remove(wanted_bytes)

        return give_back


class Turns:
    """Runs work that takes the processor: a few pieces at a time in threads of their own, some wait, more are
    refused.
    """

    def __init__(self, what: str, at_once: int, waiting: int) -> None:
        """Set up for `at_once` pieces of work and `waiting` more; `what`: the requests in the plural."""
        self._what = what
        self._most = at_once + waiting
        self._inside = 0
        self._limiter = CapacityLimiter(at_once)

    async def run(self, work: Callable[..., Any], *arguments: Any) -> Any:
        """Wait for a turn, run the work in a thread, and return its result. Raises `Overloaded`, and the errors of the
        work.
        """
        if self._inside >= self._most:
            raise Overloaded(f"{self._inside} {self._what} are running or waiting already: try again later")
        self._inside += 1
        try:
            return await to_thread.run_sync(work, *arguments, limiter=self._limiter)
        finally:
            self._inside -= 1
