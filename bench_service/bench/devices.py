"""Interface of a bench's devices without a job: their last known state, and the way to make them safe.

Light on purpose: the supervisor imports this and little else.
"""

from dataclasses import dataclass
from datetime import datetime
from typing import Protocol

from bench_service.bench.processes import ProcessIdentity

AT_REST = "at rest"
MOVING = "moving"


@dataclass(frozen=True)
class DeviceState:
    """The last reported state of a bench's devices. Angles in degrees, temperatures in °C."""

    table: str = AT_REST
    """"at rest" (locked) or "moving": a demand was sent, by any process, and has not ended."""
    angles_deg: tuple[float, float, float] | None = None
    """Outer, middle, inner axis where the table last came to rest; None: not known."""
    powered: bool = False
    """True while the unit has power."""
    chamber_target_c: float | None = None
    """The chamber's commanded temperature; None: there is no chamber, or it was never commanded."""
    chamber_ambient_c: float | None = None
    """The chamber's target temperature when the bench is made safe."""
    current_ma: float = 0.0
    """The current requested of the precision current source."""
    fault: str = ""
    """The reason why the last attempt to make the devices safe failed."""
    at: datetime | None = None
    """Time of the last command to any device; None: no command was ever sent."""
    by: str = ""
    """The process that sent that command, as text."""
    job: str | None = None
    """The job for which the command was sent."""
    openings: int = 0
    """The number of times that the devices' link was taken so far."""
    bench_file: str = ""
    """Path of the bench file of real devices; empty: all are simulated, and the register is all that there is."""
    linked: bool = False
    """True while a process has the devices' link, or had it when it died."""

    @property
    def unsafe(self) -> tuple[str, ...]:
        """The conditions that keep the unattended bench from being safe, one sentence each; empty: the bench is
        safe.
        """
        found: list[str] = []
        if self.table != AT_REST:
            found.append("the table moves")
        if self.powered:
            found.append("the unit is on")
        if self.chamber_target_c not in (None, self.chamber_ambient_c):
            found.append(f"the chamber is commanded to {self.chamber_target_c:g} °C")
        if self.current_ma != 0.0:
            found.append(f"the current source gives {self.current_ma:g} mA")
        if self.fault:
            found.append(self.fault)
        return tuple(found)

    @property
    def safe(self) -> bool:
        """True where the table is at rest, the unit off, the chamber commanded to ambient, no current flows, and no
        fault is reported.
        """
        return not self.unsafe


def commanded(state: DeviceState | None, worker: ProcessIdentity | None) -> bool:
    """Return whether the living `worker`, None where there is none, has the devices' link.

    It would command them next, so devices that are safe may not stay so until it has left its work after a stop.
    """
    return worker is not None and state is not None and state.linked


class BenchDevices(Protocol):
    """The devices of one bench, usable without a job: their state and making them safe. Interface; `drivers` implements
    it.
    """

    def device_state(self) -> DeviceState | None:
        """The devices' last reported state; None where unknown on this host. Never waits for the driving process."""
        ...

    def compare(self, by: str) -> tuple[str, ...]:
        """Ask the devices themselves: sentences about what differs from their last reported state.

        Where something differs, the reported state becomes what the devices say. Nothing is commanded; nothing is asked
        where another process has the devices' link. A device that does not answer is no difference.
        """
        ...

    def make_safe(self, by: str) -> DeviceState:
        """Stop the table, send the chamber to ambient, cut current and power; a safe bench gets no command.

        Raises `DeviceBusy` where another process has the devices' link, `BenchError`, or an `ExceptionGroup` of the
        failures; the state then has the fault.
        """
        ...
