"""PORTS of the supervisor: the bench's lease, its stops in the database, and the listener for other hosts' stops."""

from typing import Protocol

from bench_service.bench.stop.exchange import StopBooks
from bench_service.bench.stop.messages import Listening


class Lease(Protocol):
    """The exclusive right to drive a bench."""

    def release(self) -> None: ...


class Listener(Protocol):
    """A listener that takes stops from other hosts."""

    def listening(self) -> Listening | None:
        """The address at which it listens now."""
        ...


class SafetyBooks(StopBooks, Protocol):
    """The supervisor's records in the database. Every verb raises `ServiceError` if it does not answer."""

    def confirm_safe(self, by: str) -> None:
        """Record that a stopped bench is safe."""
        ...

    def say_listening(self, at: Listening) -> None:
        """Record the address where this supervisor takes stops from other hosts."""
        ...

    def stop(self, reason: str, by: str) -> None:
        """Stop the bench until a person releases it."""
        ...

    def note(self, by: str, text: str, job: str | None) -> None:
        """Record an action of the supervisor: in the audit trail, and at the job that it concerns."""
        ...
