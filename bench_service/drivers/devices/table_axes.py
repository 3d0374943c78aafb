"""Axes of a real table: limits, steps of a move where an encoder repeats each turn, and the turns of the cables."""

from collections.abc import Sequence
from dataclasses import dataclass, field
from math import ceil

from bench_service.drivers.interface.sections import Axis, WireTurntable
from procedures.bench.description import AxisLimits, BenchDescription, TableAccuracy
from procedures.core.site import Site
from procedures.core.table_angles import TableAngles

AXES = ("outer", "middle", "inner")
LONGEST_STEP_DEG = 120.0
"""Longest step of a move on an encoder of one turn: well below half a turn, so that its sense is certain."""


def declared(section: WireTurntable) -> BenchDescription:
    """Return a bench description with the table's limits from a section, by which demands are checked; its site is not
    used.
    """

    def limits(axis: Axis) -> AxisLimits:
        return AxisLimits(
            axis.minimum_deg, axis.maximum_deg, axis.rate_deg_s, axis.acceleration_deg_s2, axis.continuous
        )

    axes = (limits(section.outer), limits(section.middle), limits(section.inner))
    site = Site(latitude_deg=0.0, gravity_m_s2=9.8)
    return BenchDescription("table", site, *axes, TableAccuracy(), False, sinusoidal=section.sinusoidal)


def angles_of(values: Sequence[float]) -> TableAngles:
    """Return the table angles of three numbers, outer, middle, inner [deg]."""
    outer, middle, inner = values
    return TableAngles(outer, middle, inner)


def wrapped(angle_deg: float) -> float:
    """Return the angle within -180 … 180 [deg]."""
    return angle_deg - 360.0 * round(angle_deg / 360.0)


@dataclass
class TurnCount:
    """Turns of one axis, counted over an encoder of one turn, so that its cables are not wound up.

    Between two readings the axis turns by less than half a turn, or the count is lost: the caller reads often enough.
    """

    counts: bool
    """True where the encoder repeats each turn; else its reading is the angle itself."""
    angle_deg: float = 0.0
    known: bool = field(default=False)

    def read(self, encoder_deg: float) -> float:
        """Return the unwrapped angle by a new reading [deg]. The first one is taken as it is."""
        if not self.counts or not self.known:
            self.angle_deg = encoder_deg
        else:
            self.angle_deg += wrapped(encoder_deg - self.angle_deg)
        self.known = True
        return self.angle_deg

    def restore(self, angle_deg: float) -> None:
        """Take over a remembered unwrapped angle; the next reading corrects it within half a turn."""
        self.angle_deg, self.known = angle_deg, True


@dataclass
class TurnProgress:
    """Angle that an axis has turned at a known rate, over an encoder that may repeat each turn.

    A reading is taken to be the turn nearest to what rate and time make due, so that the count bears a pause in the
    readings of any length, as long as rate and clock are right to within half a turn.
    """

    start_deg: float
    rate_deg_s: float
    """Demanded rate, signed [deg/s]."""
    since_s: float
    """Bench time of the newest reading [s]."""
    turned_deg: float = 0.0

    def read(self, encoder_deg: float, now_s: float, less_deg: float = 0.0) -> float:
        """Return the angle turned so far, by a new reading, signed [deg]. `less_deg`: how much less than the rate's was
        turned since.
        """
        due = self.turned_deg + self.rate_deg_s * (now_s - self.since_s) - less_deg
        self.turned_deg = due + wrapped(encoder_deg - self.start_deg - due)
        self.since_s = now_s
        return self.turned_deg


def steps(start_deg: Sequence[float], end_deg: Sequence[float], counted: Sequence[bool]) -> list[list[float]]:
    """Return the angles of a move from step to step, each of three axes, the last one `end_deg`: no axis with an
    encoder of one turn by more than a step at once.
    """
    longest = max(
        (abs(end - start) for start, end, counts in zip(start_deg, end_deg, counted, strict=True) if counts),
        default=0.0,
    )
    number = max(1, ceil(longest / LONGEST_STEP_DEG - 1e-9))
    return [
        [start + (end - start) * k / number for start, end in zip(start_deg, end_deg, strict=True)]
        for k in range(1, number + 1)
    ]
