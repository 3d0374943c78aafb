"""Readings of the devices while a recording was made, with which commanded values are compared."""

from dataclasses import dataclass

from procedures.core.table_angles import TableAngles

SCATTERS = 3.0
"""Scatters of the samples' arrival that are no difference of pace."""


@dataclass(frozen=True)
class MeasuredAngles:
    """Encoder readings while a recording was made, at a table that was to stand still."""

    mean: TableAngles
    """Mean of the readings of each axis [deg]; whole turns as the encoders count them."""
    spread: TableAngles
    """Standard deviation of the readings of each axis [deg]; zero for one reading."""
    readings: int


@dataclass(frozen=True)
class MeasuredSupply:
    """Readings of the unit's supply while a recording was made."""

    voltage_v: float
    """Mean of the readings."""
    current_a: float
    """Mean of the readings."""
    current_spread_a: float
    """Standard deviation of the readings; zero for one reading."""
    limiting: bool
    """True if the supply limited the current at any reading."""
    readings: int


@dataclass(frozen=True)
class MeasuredEnvironment:
    """Means of the room's conditions while a recording was made; None: not measured."""

    temperature_c: float | None = None
    humidity_percent: float | None = None
    pressure_hpa: float | None = None


@dataclass(frozen=True)
class MeasuredPace:
    """Pace of a unit's samples over wires, by the bench's clock."""

    behind_s: float
    """Time by which the samples fell behind the clock over the recording [s]: their number over the declared rate is
    less than the time that passed; negative: they came faster."""
    scatter_s: float
    """Scatter of the moments at which samples came [s]: what holds a block up, and no loss."""

    def differs(self, share: float, length_s: float) -> bool:
        """True if the samples parted from the clock by more than a share of the recording's length [s], and by more
        than three scatters of their arrival.
        """
        return abs(self.behind_s) > max(share * length_s, SCATTERS * self.scatter_s)

    @property
    def direction(self) -> str:
        """Beginning of a sentence: the samples, and whether they fell behind the clock or were ahead of it."""
        way = "fell behind" if self.behind_s > 0.0 else "were ahead of"
        return f"the unit's samples {way} the bench's clock"


@dataclass(frozen=True)
class Measured:
    """Readings of the devices around the unit while a recording was made; None: not read."""

    angles: MeasuredAngles | None = None
    supply: MeasuredSupply | None = None
    environment: MeasuredEnvironment | None = None
    status: tuple[str, ...] = ()
    """Status words of table, supply and unit that were read meanwhile, each once, by first appearance."""
    pace: MeasuredPace | None = None
    """None: the unit is simulated in process, where its samples are the clock, or the recording is too short."""
