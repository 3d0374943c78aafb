"""Common parts of drivers of devices on a wire: the greeting of a new line, its times, and the sentence for a
refusal.
"""

from collections.abc import Awaitable, Callable, Mapping
from typing import Any, TypeVar

from bench_service.drivers.answers import Refusal
from bench_service.drivers.interface.sections import Wire
from bench_service.drivers.link.exchange import Ask, LineTimes, Request
from procedures.bench.device import DeviceIdentity
from procedures.bench.errors import DeviceFault

T = TypeVar("T")
Note = Callable[[str, Mapping[str, Any]], None]


class Greeting:
    """Asks a device on each new line who it is and how it is, before anything else."""

    def __init__(
        self,
        device: str,
        identity: Request[DeviceIdentity],
        status: Callable[[Ask], None],
        note: Note,
    ) -> None:
        """Set up; `status`: asks for the device's status and keeps it. Runs in the line's own thread."""
        self._device, self._status, self._note = device, status, note
        self.identity = identity
        self.known: DeviceIdentity | None = None
        """Identity of the device at the newest line."""

    def check(self, identity: DeviceIdentity, ask: Ask) -> None:
        """Compare the identity, ask for status. Raises `DeviceFault` where another device answers than before."""
        if self.known is not None and identity != self.known:
            raise DeviceFault(f"another {self._device} answers: {identity}, and before it was {self.known}")
        self.known = identity
        self._note(f"{self._device}.linked", {"identity": str(identity)})
        try:
            self._status(ask)
        except Refusal as refusal:
            raise DeviceFault(f"the {self._device} does not report its status: {refusal}") from None


def line_times(section: Wire, after_demand_s: float = 0.0) -> LineTimes:
    """Return the times of a line by its section: a verb's request may take a new connection and a second try."""
    deadline = section.connect_s + 2.0 * section.answer_s + after_demand_s
    return LineTimes(section.answer_s, deadline, section.connect_s, after_demand_s)


async def accepted(asked: Awaitable[T], device: str, name: str) -> T:
    """Wait for a device's answer and return it. Raises `DeviceFault` with the device's words where it refuses."""
    try:
        return await asked
    except Refusal as refusal:
        raise DeviceFault(f"the {device} refuses {name}: {refusal}") from None
