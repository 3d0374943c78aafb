"""What an inspection says: findings a channel, each with a sentence for a person, and what may be set."""

from collections.abc import Sequence
from dataclasses import dataclass
from enum import StrEnum
from typing import Literal

from procedures.core.errors import BadParameter, UnfitRecording


class Severity(StrEnum):
    """What a finding means to an analysis."""

    REFUSE = "refuse"
    """No number of this channel can be believed."""
    WARN = "warn"
    """The analysis goes on, and its result says this."""


class Kind(StrEnum):
    """What is wrong with a channel."""

    TOO_FEW = "too_few"
    INCOMPLETE = "incomplete"
    NOT_FINITE = "not_finite"
    CONSTANT = "constant"
    SATURATED = "saturated"
    STUCK_BIT = "stuck_bit"
    RESOLUTION = "resolution"
    REPEATED = "repeated"
    OUTLIER = "outlier"
    STEP = "step"
    WRONG_UNIT = "wrong_unit"
    WRONG_RATE = "wrong_rate"
    UNLIKELY_RATE = "unlikely_rate"
    STANDS_STILL = "stands_still"
    COPIED = "copied"
    WRAPPED = "wrapped"
    NOISE_CHANGE = "noise_change"


@dataclass(frozen=True)
class Finding:
    """One flaw of one channel."""

    kind: Kind
    severity: Severity
    sentence: str
    """Names the channel, the value and what was expected."""
    first_index: int | None = None
    """Sample where it is first seen, counted from 0; None where it is of the whole recording."""
    count: int = 0
    """Samples concerned."""
    of_row: bool = False
    """Whether whole rows are concerned, whatever the channel: such a finding is never of a channel alone."""


@dataclass(frozen=True)
class ChannelFitness:
    """All findings of one channel; none: it is fit."""

    channel: str
    findings: tuple[Finding, ...]

    @property
    def refused(self) -> bool:
        """Whether any finding forbids an analysis."""
        return any(f.severity is Severity.REFUSE for f in self.findings)


@dataclass(frozen=True)
class FitnessSettings:
    """What is expected of a recording. SI."""

    least_samples: int = 20
    """Fewer are refused: the standard uncertainty of a mean is taken from 20 batches (see `station_means`)."""
    gaps: Literal["refuse", "aware"] = "refuse"
    """Samples that are no numbers: "refuse", or "aware": a warning, for an analysis that leaves gaps out."""
    counters_may_rest: bool = False
    """A counter that stands still is warned of, not refused: across the Earth's rate it gives no pulse for minutes, so
    a dwell of a calibration may well be silent. A static run that is silent has nothing to analyse."""
    at_rest: bool = True
    """The unit neither turns faster than the Earth nor is accelerated but by gravity: units and jumps can be judged."""
    beside_others: bool = False
    """The recording is one of several stations: a channel that reads one value is judged over all of them (see
    `station_means`), so a counter that is silent is not even warned of, and samples that are constant are."""
    means_only: bool = False
    """The analysis takes means: rows sent more than once and copied samples leave these right, and are warned of."""
    seeks_scale: bool = False
    """The analysis is to find scale factors: a reading that is off by a factor is warned of, not refused."""
    reads_gravity: bool = True
    """The accelerometers feel gravity, not a current that is fed into their converter."""
    mends_outliers: bool = False
    """Outliers that are few will be replaced by the mean of their neighbours, and the sentence says so."""
    gravity_m_s2: float | None = None
    """Of the site [m/s²]; None: standard gravity."""
    gyro_rest_rad_s: float = 0.5
    """A gyro at rest reads less [rad/s]: ours; data sheets of consumer gyros allow ±20 °/s = 0.35 rad/s of zero-rate
    output. Degrees a second cannot be told from radians by this unless the gyro is better, so set it to the Earth's
    rate plus a bound of the bias where that is known."""

    def __post_init__(self) -> None:
        for name, value, low, high in (
            ("least_samples", self.least_samples, 1, 10**9),
            ("gravity_m_s2", self.gravity_m_s2 or 9.8, 9.7, 9.9),
            ("gyro_rest_rad_s", self.gyro_rest_rad_s, 7.3e-5, 1e3),
        ):
            if not low <= value <= high:
                raise BadParameter(name, value, f"must be within {low:g} … {high:g}")
        if self.gaps not in ("refuse", "aware"):
            raise BadParameter("gaps", self.gaps, 'must be "refuse" or "aware"')


def require_fit(recording_id: str, fitness: Sequence[ChannelFitness]) -> tuple[str, ...]:
    """The sentences of all warnings, each once. Raises `UnfitRecording` with those of all refusals."""
    refusals = _sentences(fitness, Severity.REFUSE)
    if refusals:
        raise UnfitRecording(f"recording {recording_id}: {'; '.join(refusals)}")
    return _sentences(fitness, Severity.WARN)


def _sentences(fitness: Sequence[ChannelFitness], severity: Severity) -> tuple[str, ...]:
    return tuple(dict.fromkeys(f.sentence for c in fitness for f in c.findings if f.severity is severity))
