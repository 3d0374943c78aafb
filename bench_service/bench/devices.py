"""PORT to a bench's devices without a job: what they last said of themselves, and the way to make them safe.

Light on purpose: the supervisor imports this and little else.
"""

from dataclasses import dataclass
from datetime import datetime
from typing import Protocol

AT_REST = "at rest"
MOVING = "moving"


@dataclass(frozen=True)
class DeviceState:
    """What a bench's devices last said of themselves. Angles in degrees, temperatures in °C."""

    table: str = AT_REST
    """"at rest" (locked) or "moving": a demand was sent and has not ended, whoever sent it."""
    angles_deg: tuple[float, float, float] | None = None
    """Outer, middle, inner axis where the table last came to rest; None: not known."""
    powered: bool = False
    """Whether the unit has power."""
    chamber_target_c: float | None = None
    """Where the chamber goes; None: there is none, or it was never commanded."""
    chamber_ambient_c: float | None = None
    """Where it goes when the bench is made safe."""
    current_ma: float = 0.0
    """What the precision current source was asked for."""
    fault: str = ""
    """Why the devices could not be made safe the last time that it was tried."""
    at: datetime | None = None
    """When something was last asked of them; None: nothing ever was."""
    by: str = ""
    """The process that asked, in words."""
    job: str | None = None
    """The job for which it asked."""
    openings: int = 0
    """How often the devices' link was taken so far."""
    linked: bool = False
    """Whether a process has, or at its death had, the devices' link."""

    @property
    def unsafe(self) -> tuple[str, ...]:
        """What is not as it must be on a bench that is left alone; empty: the bench is safe."""
        found: list[str] = []
        if self.table != AT_REST:
            found.append("the table moves")
        if self.powered:
            found.append("the unit is on")
        if self.chamber_target_c not in (None, self.chamber_ambient_c):
            found.append(f"the chamber is led to {self.chamber_target_c:g} °C")
        if self.current_ma != 0.0:
            found.append(f"the current source gives {self.current_ma:g} mA")
        if self.fault:
            found.append(self.fault)
        return tuple(found)

    @property
    def safe(self) -> bool:
        """Table at rest, unit off, chamber led to ambient, no current, and no fault in the way."""
        return not self.unsafe


class BenchDevices(Protocol):
    """The devices of one bench, usable without a job."""

    def device_state(self) -> DeviceState | None:
        """What they last said; None where this host does not know. Never waits for whoever drives them."""
        ...

    def make_safe(self, by: str) -> DeviceState:
        """Stop the table, lead the chamber to ambient, no current, the unit off; on a safe bench nothing is asked.

        Raises `DeviceBusy` where another process has the devices' link, `BenchError`, or an `ExceptionGroup` of what
        failed; then the state says it.
        """
        ...
