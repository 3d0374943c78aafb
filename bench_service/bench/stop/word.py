"""A stop as the channel of a bench has it, and what worker and supervisor answer to it."""

from dataclasses import asdict, dataclass, field
from datetime import datetime
from typing import Any

from bench_service.wall_clock import new_id, now

REASON, BY = 500, 100
"""Of a reason and of a name so much is kept in the channel [characters]."""


@dataclass(frozen=True)
class StopWord:
    """One person's stop: why, who, when, and over which way it came."""

    reason: str
    by: str
    via: str
    """"http", "page", "command", "listener", or "books": it was in the database before it was here."""
    id: str = field(default_factory=new_id)
    at: datetime = field(default_factory=now)
    booked: bool = False
    """Whether the database has it."""

    def document(self) -> dict[str, Any]:
        """As JSON has it, the texts cut to what a record holds."""
        return {**asdict(self), "at": self.at.isoformat(), "reason": self.reason[:REASON], "by": self.by[:BY]}

    @classmethod
    def of(cls, document: dict[str, Any]) -> "StopWord":
        """Raises `TypeError`, `ValueError`, `KeyError` for what is no word."""
        given: dict[str, Any] = {**document, "at": datetime.fromisoformat(document["at"])}
        return cls(**given)


DAMAGED = StopWord("a record of the stop channel cannot be read", "the stop channel", "books", "damaged", booked=True)
"""Stands for a record that is there and cannot be read: until a person releases the bench it is a stop."""


@dataclass(frozen=True)
class StopAnswer:
    """What worker or supervisor has made of the words so far."""

    by: str = ""
    seen: frozenset[str] = frozenset()
    safe: frozenset[str] = frozenset()
    """Words after which the devices were seen safe."""
