"""Interfaces that the supervisor needs: the bench's lease, its stops in the database, and the listener for other hosts'
stops.
"""

from typing import Protocol

from bench_service.bench.stop.exchange import StopBooks
from bench_service.bench.stop.messages import Listening


class Lease(Protocol):
    """The exclusive right to drive a bench, as the supervisor takes it to make the bench safe. Interface."""

    def release(self) -> None: ...


class Listener(Protocol):
    """A server that takes stops from other hosts. Interface; see `StopListener`."""

    def listening(self) -> Listening | None:
        """Return the address at which it listens now; None where it does not."""
        ...


class SafetyBooks(StopBooks, Protocol):
    """Records of the supervisor in the database: stops, confirmations, notes. Interface; every verb raises
    `ServiceError` if the database does not answer.
    """

    def confirm_safe(self, by: str) -> None:
        """Store in each standing stop that the bench was seen safe, by this process."""
        ...

    def say_listening(self, at: Listening) -> None:
        """Store the address where this supervisor takes stops from other hosts."""
        ...

    def stop(self, reason: str, by: str) -> None:
        """Store a stop of the bench, which stands until a person releases it."""
        ...

    def note(self, by: str, text: str, job: str | None) -> None:
        """Write an action of the supervisor into the audit trail, and into the events of the job that it concerns
        (None: no job).
        """
        ...
