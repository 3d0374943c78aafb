"""ASCII-2 protocol of climatic chambers: all set points and switches in one line; from published code.

Resolution is 0.1 °C. Number and meaning of the fields differ from machine to machine: they are settings.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from math import isfinite

from bench_service.drivers.answers import BadAnswer, shown

ENDING = b"\r"
LOWEST, HIGHEST = -999.9, 9999.9
"""Range of a field of six characters."""
BANNER = b"100 OK:"


@dataclass(frozen=True)
class Layout:
    """Layout of one machine's lines, as its own help (`$01?`) has it; the default is a Vc3 7060."""

    address: int = 1
    analogue: int = 7
    """Number of analogue channels: a write has as many fields, a read twice as many."""
    digital: int = 32
    """Number of switches; a machine may answer with more characters than its help says."""
    temperature: int = 0
    """Place of the temperature among the analogue channels, from 0."""
    start: int = 1
    """Place of the start switch, from 0."""
    door: int | None = None
    """Place of a bit that says that the door is open, from 0; None: the machine does not say it."""
    alarm: int | None = None
    """Place of a bit that says that the machine has switched itself off; None: it does not say it."""

    def __post_init__(self) -> None:
        if not (0 <= self.address <= 99 and 1 <= self.analogue <= 32 and 1 <= self.digital <= 128):
            raise ValueError("address is 0 … 99, analogue 1 … 32, digital 1 … 128")
        if not 0 <= self.temperature < self.analogue:
            raise ValueError(f"temperature = {self.temperature} is outside 0 … {self.analogue - 1}")
        for name in ("start", "door", "alarm"):
            place = getattr(self, name)
            if place is not None and not 0 <= place < self.digital:
                raise ValueError(f"{name} = {place} is outside 0 … {self.digital - 1}")


@dataclass(frozen=True)
class State:
    """Set points, actual values and switches of all channels of a chamber at one moment."""

    set_points: tuple[float, ...]
    actual: tuple[float, ...]
    digital: str
    """Switches as they came, which may be more than the layout has."""

    def bit(self, place: int | None) -> bool:
        """Return whether the switch at index `place` (from 0) is on; None, a switch that the layout does not have, is
        off.
        """
        return place is not None and self.digital[place] == "1"


def read_request(layout: Layout) -> bytes:
    """Return the bytes that ask for the chamber's state."""
    return f"${layout.address:02d}I".encode("ascii") + ENDING


def field(value: float) -> str:
    """Return an analogue value as a field of six characters. Raises `ValueError` where it does not fit."""
    if not isfinite(value) or not LOWEST <= round(value, 1) <= HIGHEST:
        raise ValueError(f"{value!r} does not fit into a field, which holds {LOWEST} … {HIGHEST}")
    return f"{value + 0.0:06.1f}"


def write_request(layout: Layout, set_points: Sequence[float], digital: str) -> bytes:
    """Return the bytes that set all set points and switches at once. Raises `ValueError`."""
    if len(set_points) != layout.analogue:
        raise ValueError(f"{len(set_points)} set points, the machine has {layout.analogue}")
    if len(digital) < layout.digital or set(digital) - {"0", "1"}:
        raise ValueError(f"switches {digital!r} are not {layout.digital} characters 0 and 1")
    fields = " ".join(field(value) for value in set_points)
    return f"${layout.address:02d}E {fields} {digital}".encode("ascii") + ENDING


def gradient_request(layout: Layout, up_k_min: float, down_k_min: float) -> bytes:
    """Return the bytes that set the ramps up and down [K/min], those of humidity zero; seen in an emulator only."""
    fields = " ".join(field(value) for value in (up_k_min, down_k_min, 0.0, 0.0))
    return f"${layout.address:02d}U {fields}".encode("ascii") + ENDING


def with_bit(digital: str, place: int, on: bool) -> str:
    """Return the digits of the switches, one a switch, with the one at index `place` (from 0) set to 1 or 0."""
    return digital[:place] + ("1" if on else "0") + digital[place + 1 :]


def state(layout: Layout, answer: bytes) -> State:
    """Return the state from the answer to a read: of each channel first the set point, then the actual value. Raises
    `BadAnswer`.
    """
    if answer.startswith(BANNER):
        raise BadAnswer(f"{shown(answer)} is the banner of another port of the controller")
    try:
        parts = answer.decode("ascii").split()
    except UnicodeDecodeError:
        raise BadAnswer(f"{shown(answer)} is not text") from None
    if len(parts) != 2 * layout.analogue + 1:
        raise BadAnswer(
            f"{shown(answer)} has {len(parts)} fields where the layout has {2 * layout.analogue + 1}: compare it with "
            "the machine's own help, $01?"
        )
    digital = parts[-1]
    if len(digital) < layout.digital or len(digital) > 256 or set(digital) - {"0", "1"}:
        raise BadAnswer(f"{digital[:40]!r} are not the {layout.digital} switches of the layout")
    values = [_number(part) for part in parts[:-1]]
    return State(tuple(values[0::2]), tuple(values[1::2]), digital)


def acknowledged(answer: bytes) -> None:
    """Check that an answer is short enough to be an acknowledgement, not an answer to a read; its text is not
    specified. Raises `BadAnswer`.
    """
    if len(answer) > 16 or len(answer.split()) > 1:
        raise BadAnswer(f"{shown(answer)} is not an acknowledgement of a write")


def _number(part: str) -> float:
    try:
        value = float(part)
    except ValueError:
        raise BadAnswer(f"{part!r} is not a number") from None
    if not isfinite(value) or "_" in part:
        raise BadAnswer(f"{part!r} is not a finite number")
    return value
