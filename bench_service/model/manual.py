"""Values of manual mode: an operator's lease on an idle bench, and the demands that it makes."""

from dataclasses import dataclass, field
from datetime import datetime
from enum import StrEnum
from typing import Any, Literal

DemandKind = Literal["home", "go_to", "rate", "halt", "chamber", "supply_on", "supply_off"]
MOTIONS = frozenset({"home", "go_to", "rate"})
"""Demands that move the table; one at a time."""


class DemandState(StrEnum):
    """States of a demand of manual mode, from accepted to its end."""

    ACCEPTED = "accepted"
    DOING = "doing"
    DONE = "done"
    REFUSED = "refused"
    """A limit or the bench's state forbids it; nothing was commanded."""
    FAILED = "failed"
    """A device did not do it."""
    STOPPED = "stopped"
    """A halt, a stop or the end of the lease came first."""

    @property
    def over(self) -> bool:
        """True for a state that is never left: the demand is done, refused, failed or stopped."""
        return self not in (DemandState.ACCEPTED, DemandState.DOING)


@dataclass(frozen=True)
class Answer:
    """Outcome of a demand for its client: a sentence, and of a refusal the field, its value and what is allowed."""

    text: str = ""
    field: str | None = None
    """Field of the demand that was refused; None: not a field's fault."""
    value: Any = None
    allowed: str | None = None
    """Allowed range of that field."""


@dataclass(frozen=True)
class ManualLease:
    """An operator's right to command the devices of a bench by hand, for some time."""

    id: str
    bench: str
    unit: str
    """Serial of the unit on the table."""
    holder: str
    proven: bool
    """True where the service knows the holder by a log-in; False: the name was declared."""
    reason: str
    created_at: datetime
    until: datetime
    """Moment at which the lease ends by itself; renewing moves it."""
    reservation: str | None = None
    began_at: datetime | None = None
    """Moment at which the bench's worker took it; None: not yet."""
    process: str = ""
    """The worker that runs it."""
    heard: int = 0
    """Number of signs of life of the processes that answer clients: one that stands still means that all are gone."""
    end_asked: str = ""
    """The person who asked for its end; empty: nobody did."""
    ended_at: datetime | None = None
    ended_because: str = ""
    safe: bool | None = None
    """Whether the bench was left safe; None while the lease is active."""

    def live(self, at: datetime) -> bool:
        """Return whether the lease holds the bench at a moment. Its end is this one moment and not that of its last
        motion.
        """
        return self.ended_at is None and at < self.until


@dataclass(frozen=True)
class ManualDemand:
    """One demand of a lease, as it was accepted, with its state and its answer."""

    id: str
    lease: str
    key: str
    """Key of the client: a demand that comes again with it is the same one."""
    kind: DemandKind
    values: dict[str, Any]
    by: str
    at: datetime
    state: DemandState = DemandState.ACCEPTED
    answer: Answer = field(default_factory=Answer)
    ended_at: datetime | None = None
