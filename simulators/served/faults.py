"""Plan of faults of a served bench: of the lines, and of the devices behind them."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

LINE_FAULTS = ("slow", "half", "doubled", "cut", "cut_after", "silent")
UNIT_FAULTS = ("wrong_crc", "lost_counter", "invalid")
DEVICE_FAULTS = ("stuck_sensor", "trip", "door", "interlock")
KINDS = LINE_FAULTS + UNIT_FAULTS + DEVICE_FAULTS
DEVICES = ("turntable", "chamber", "supply", "unit_link")


@dataclass(frozen=True)
class Fault:
    """One fault. With `every` it befalls each n-th answer or frame; with `at` a single one; with `from_s` a time."""

    device: str
    kind: str
    every: int = 0
    """Each n-th answer or frame, counted from the beginning; 0: none."""
    at: int = 0
    """The n-th answer or frame alone; 0: none."""
    from_s: float = 0.0
    """Bench time from which a fault of a device holds [s]."""
    seconds: float = 1.5
    """Delay of a slow answer in real time [s]."""

    def __post_init__(self) -> None:
        if self.device not in DEVICES:
            raise ValueError(f"fault.device = {self.device!r} is none of {', '.join(DEVICES)}")
        if self.kind not in KINDS:
            raise ValueError(f"fault.kind = {self.kind!r} is none of {', '.join(KINDS)}")
        if self.every < 0 or self.at < 0 or not 0.0 <= self.from_s < float("inf"):
            raise ValueError(f"fault {self.kind!r}: every, at and from_s must not be negative")
        if not 0.0 <= self.seconds <= 3600.0:
            raise ValueError(f"fault {self.kind!r}: seconds = {self.seconds!r} is outside 0 … 3600")
        if self.kind not in DEVICE_FAULTS and not (self.every or self.at):
            raise ValueError(f"fault {self.kind!r} needs `every` or `at`")

    def strikes(self, number: int) -> bool:
        """True if it befalls the answer or frame of this number, from 1."""
        return number == self.at or (self.every > 0 and number % self.every == 0)

    @classmethod
    def of(cls, table: Mapping[str, Any]) -> "Fault":
        """Read a fault from a table of a file. Raises `ValueError` naming the key."""
        unknown = sorted(set(table) - set(cls.__dataclass_fields__))
        if unknown:
            raise ValueError(f"fault.{unknown[0]} is unknown; there is {', '.join(cls.__dataclass_fields__)}")
        if not {"device", "kind"} <= set(table):
            raise ValueError("a fault needs `device` and `kind`")
        return cls(**table)


@dataclass
class FaultPlan:
    """Faults that are to come, and how many answers or frames each device has sent."""

    faults: Sequence[Fault] = ()
    sent: dict[str, int] = field(default_factory=dict[str, int])

    def next(self, device: str) -> Fault | None:
        """Count an answer or frame of a device; the fault that befalls it, or None."""
        number = self.sent[device] = self.sent.get(device, 0) + 1
        found = (f for f in self.faults if f.device == device and f.kind not in DEVICE_FAULTS and f.strikes(number))
        return next(found, None)

    def due(self, now_s: float) -> list[Fault]:
        """Take the faults of devices whose time has come."""
        due = [f for f in self.faults if f.kind in DEVICE_FAULTS and f.from_s <= now_s]
        self.faults = [f for f in self.faults if f not in due]
        return due
