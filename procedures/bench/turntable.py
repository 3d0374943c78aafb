"""Interface of the three-axis turntable."""

from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from procedures.bench.device import Device, Status
from procedures.bench.errors import DeviceFault
from procedures.core.constant_rate import ConstantRate
from procedures.core.sinusoid import Sinusoid
from procedures.core.table_angles import TableAngles
from procedures.core.turn import Turn

OVER_DEG_S, OVER_DEG = 0.01, 0.1
"""Largest rate, and largest distance from the angle of their beginning, at which whole turns are over."""


@dataclass(frozen=True)
class TableReading:
    """State of the table at one moment, as its encoders and its controller have it."""

    time_s: float
    """Bench time of the reading [s]; its age is the clock's time less this."""
    angles: TableAngles
    """Angles of the axes by their encoders, not the demands [deg]."""
    moving: bool
    """True while an axis follows a demand, or settles after it."""
    status: Status = ()
    """Status words of the controller: interlocks, limiters, faults."""
    homed: bool = True
    """False where the encoders do not know their zero: no angle is known, and no axis may move by it."""
    rates_deg_s: tuple[float, float, float] | None = None
    """Rates of outer, middle and inner axis [deg/s]; None where the controller reports none."""


@dataclass(frozen=True)
class EncoderTrace:
    """Readings of the encoders during a sinusoid, in order of time."""

    time_s: NDArray[np.float64]
    """Bench time of each reading [s], (n,)."""
    angles_deg: NDArray[np.float64]
    """Angles of outer, middle and inner axis [deg], (n, 3)."""
    within_s: NDArray[np.float64]
    """Half the interval in which the reading was taken [s], (n,): its time is known to ± so much. 0: exactly."""


NO_TRACE = EncoderTrace(np.empty(0), np.empty((0, 3)), np.empty(0))
MOST_TRACED = 100_000
"""Largest number of readings that a table keeps for `Turntable.trace`; older ones are dropped."""


class Turntable(Device, Protocol):
    """Three-axis turntable. `move_to` and `settle` return when all axes are at rest and locked, the other verbs as soon
    as the table has answered.

    No verb holds the bench's loop: each awaits the table's answer, with a deadline.
    """

    async def move_to(self, angles: TableAngles) -> None:
        """Move all axes, and return when they have settled and are locked. Raises `OutOfRange` before anything moves,
        `NotSettled`, `DeviceFault`.
        """
        ...

    async def command_turn(self, turn: Turn) -> None:
        """Begin whole turns of one axis, the others held; the table does the rest while time passes elsewhere.

        Returns when the table has taken the demand. Raises `OutOfRange` before anything moves, `DeviceFault` where the
        table moves already, `Disconnected`.
        """
        ...

    async def command_rate(self, rate: ConstantRate) -> None:
        """Begin a constant rate of one axis, the others held; otherwise as `command_turn`. `make_safe` ends it early.

        Raises `OutOfRange` before anything moves, also where an axis without slip rings would leave its range.
        """
        ...

    async def command_sinusoid(self, sinusoid: Sinusoid) -> None:
        """Begin whole cycles of one axis about its present angle, the others held; otherwise as `command_turn`.

        The table may begin and end the cycles in its own way, and is led back to the angle where they began. Raises
        `OutOfRange` before anything moves, also where `BenchDescription.sinusoidal` is False.
        """
        ...

    def trace(self) -> EncoderTrace:
        """Take the readings that the table has made since the last call; waits on no line.

        They are made from the begin of a sinusoid to its end, as often as the table can; there are none otherwise.
        """
        ...

    async def settle(self) -> None:
        """Wait until the commanded motion is done and the axes are at rest and locked; at once where they are.

        Raises `NotSettled`, `DeviceFault`, `Stopped` where another demand took over.
        """
        ...

    async def read(self) -> TableReading:
        """Return encoder angles, rates and status words; at any time, during a motion too. Raises `Disconnected`."""
        ...

    async def make_safe(self) -> None:
        """Ramp down to rest and lock, from any motion; returns once the encoders show rest.

        A table at rest gets no command, unless an axis is in a mode that is to move it. Raises `DeviceFault`,
        `Disconnected`.
        """
        ...


def appended(kept: EncoderTrace, fresh: EncoderTrace) -> EncoderTrace:
    """Return readings after earlier ones, the newest `MOST_TRACED` of them."""
    return EncoderTrace(
        np.concatenate([kept.time_s, fresh.time_s])[-MOST_TRACED:],
        np.concatenate([kept.angles_deg, fresh.angles_deg])[-MOST_TRACED:],
        np.concatenate([kept.within_s, fresh.within_s])[-MOST_TRACED:],
    )


def require_turns_over(begin: TableAngles | None, turn: Turn, reading: TableReading) -> None:
    """Check that a recording that ends now holds its turns as a whole. Raises `DeviceFault` with what is left of them.

    `begin`: angles where they began; None: not known, and only the rate is looked at.
    """
    rates = dict(zip(("outer", "middle", "inner"), reading.rates_deg_s or (0.0, 0.0, 0.0), strict=True))
    began, shown = (getattr(angles, f"{turn.axis}_deg") for angles in (begin or reading.angles, reading.angles))
    left_deg = shown - began - 360.0 * round((shown - began) / 360.0)
    if abs(rates[turn.axis]) > OVER_DEG_S or abs(left_deg) > OVER_DEG:
        raise DeviceFault(
            f"the recording ends before the turns do: the {turn.axis} axis is {left_deg:.4g} deg from their end, at "
            f"{rates[turn.axis]:.4g} deg/s, because it was braked late; give a longer rest after the turns (rest_s "
            "of scale_factor_whole_turns and polarity_check) or ramp_s, or served simulators a smaller time_factor"
        )
