"""PORTS of the supervisor: the bench's lease, the books, and the listener for stops from other hosts."""

from typing import Protocol

from bench_service.bench.stop.exchange import StopBooks
from bench_service.bench.stop.messages import Listening


class Lease(Protocol):
    """The right to drive a bench."""

    def release(self) -> None: ...


class Listener(Protocol):
    """Takes stops from other hosts."""

    def listening(self) -> Listening | None:
        """Where it does so now."""
        ...


class SafetyBooks(StopBooks, Protocol):
    """What the supervisor reads and writes in the database. Every verb raises `ServiceError` if it does not answer."""

    def confirm_safe(self, by: str) -> None:
        """A stopped bench is safe."""
        ...

    def say_listening(self, at: Listening) -> None:
        """Remember where this supervisor takes stops from other hosts."""
        ...

    def stop(self, reason: str, by: str) -> None:
        """Stop the bench until a person releases it."""
        ...

    def note(self, by: str, text: str, job: str | None) -> None:
        """Say what was done: in the trail, and to the job that it concerns."""
        ...
