"""A stop request as the channel of a bench holds it, and the answer of worker and supervisor to it."""

from dataclasses import asdict, dataclass, field, fields
from datetime import datetime
from typing import Any

from bench_service.wall_clock import new_id, now

REASON, BY = 500, 100
"""Maximum lengths of a reason and of a name that the channel keeps [characters]."""


@dataclass(frozen=True)
class StopWord:
    """One person's stop request as the stop channel holds it: id, reason, person, time, and the route over which it
    came.
    """

    reason: str
    by: str
    via: str
    """"http", "page", "command", "listener", or "books" for a stop that was in the database before it was in the
    channel."""
    id: str = field(default_factory=new_id)
    at: datetime = field(default_factory=now)
    booked: bool = False
    """True once the database has this stop."""
    restored: bool = False
    """True where a database that had this stop does not know it any more, as after a restored copy: it is entered
    again. Not kept in the channel."""

    def __post_init__(self) -> None:
        """Escape the characters of its texts that no database and no answer can hold.

        A terminal of another encoding gives them. A stop that the database never takes is never released.
        """
        for name in ("reason", "by"):
            text: str = getattr(self, name)
            plain = text.replace("\0", "\\x00").encode(errors="backslashreplace").decode()
            object.__setattr__(self, name, plain)

    def document(self) -> dict[str, Any]:
        """The request as a JSON object, its texts cut to the room of a record."""
        found = {**asdict(self), "at": self.at.isoformat(), "reason": self.reason[:REASON], "by": self.by[:BY]}
        del found["restored"]  # a process of an older version reads the record too
        return found

    @classmethod
    def of(cls, document: dict[str, Any]) -> "StopWord":
        """Read a request from a document; fields of a newer version are left out.

        Raises `TypeError`, `ValueError`, `KeyError`, `AttributeError` for any other document.
        """
        at = datetime.fromisoformat(document["at"])
        if at.tzinfo is None:
            raise ValueError(f"at = {document['at']!r}: a time with its zone is expected")
        known = {each.name for each in fields(cls)}
        given: dict[str, Any] = {name: value for name, value in document.items() if name in known}
        given["at"] = at
        return cls(**given)


DAMAGED = StopWord("a record of the stop channel cannot be read", "the stop channel", "books", "damaged", booked=True)
"""Stands for a record that cannot be read: it counts as a stop until a person releases the bench."""


@dataclass(frozen=True)
class StopAnswer:
    """Progress of the worker or supervisor with the stop requests: ids of those that it has seen, and of those after
    which the bench was safe.
    """

    by: str = ""
    seen: frozenset[str] = frozenset()
    safe: frozenset[str] = frozenset()
    """Ids of the requests after which the devices were seen safe."""
