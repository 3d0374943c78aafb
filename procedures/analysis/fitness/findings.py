"""Results of an inspection, findings per channel with a sentence each, and the settings of an inspection."""

from collections.abc import Sequence
from dataclasses import dataclass
from enum import StrEnum
from typing import Literal

from procedures.core.errors import BadParameter, UnfitRecording


class Severity(StrEnum):
    """Consequence of a finding for an analysis: it is refused, or it warns."""

    REFUSE = "refuse"
    """The channel's numbers cannot be trusted; the analysis is refused."""
    WARN = "warn"
    """The analysis continues, and its result carries the sentence."""


class Kind(StrEnum):
    """Kinds of flaws of a channel."""

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
    TWIN = "twin"
    EVEN_STEPS = "even_steps"
    WRAPPED = "wrapped"
    NOISE_CHANGE = "noise_change"
    MISREAD = "misread"


@dataclass(frozen=True)
class Finding:
    """One flaw found in one channel: its kind, its consequence, a sentence, the first sample and the number of
    samples.
    """

    kind: Kind
    severity: Severity
    sentence: str
    """Sentence naming the channel, the value and the expected one."""
    first_index: int | None = None
    """First sample concerned, counted from 0; None where the whole recording is."""
    count: int = 0
    """Number of samples concerned."""
    of_row: bool = False
    """True if whole rows are concerned, irrespective of the channel."""


@dataclass(frozen=True)
class ChannelFitness:
    """All findings of one channel; it is fit for analysis where there are none."""

    channel: str
    findings: tuple[Finding, ...]

    @property
    def refused(self) -> bool:
        """True if any finding forbids an analysis."""
        return any(f.severity is Severity.REFUSE for f in self.findings)


@dataclass(frozen=True)
class FitnessSettings:
    """Requirements of an analysis on a recording (length, gaps, rest), and references for plausibility, in SI."""

    least_samples: int = 20
    """Fewest samples accepted: the standard uncertainty of a mean is taken from 20 batches (see `station_means`)."""
    gaps: Literal["refuse", "aware"] = "refuse"
    """Treatment of samples that are not numbers: "refuse", or "aware", a warning for an analysis that omits gaps."""
    counters_may_rest: bool = False
    """A counter that stands still causes a warning, not a refusal: across the Earth's rate it gives no pulse for
    minutes, so a dwell of a calibration may well be silent. A silent static run has nothing to analyse."""
    at_rest: bool = True
    """The unit neither turns faster than the Earth nor is accelerated but by gravity: units and jumps can be judged."""
    beside_others: bool = False
    """The recording is one of several stations: a channel that reads one value is judged over all of them (see
    `station_means`), so a silent counter causes no warning, and constant samples cause one."""
    means_only: bool = False
    """The analysis uses means, which repeated rows and copied samples leave right: these only cause warnings."""
    seeks_scale: bool = False
    """The analysis determines scale factors: a reading that is off by a factor causes a warning, not a refusal."""
    reads_gravity: bool = True
    """The accelerometers feel gravity, not a current that is fed into their converter."""
    mends_outliers: bool = False
    """Few outliers are replaced by the mean of their neighbours, as the sentence then states."""
    gravity_m_s2: float | None = None
    """Gravity at the site [m/s²]; None: standard gravity."""
    gyro_rest_rad_s: float = 0.5
    """Bound on the reading of a gyro at rest [rad/s], our choice; data sheets of consumer gyros allow ±20 °/s = 0.35
    rad/s of zero-rate output. The bound distinguishes degrees a second from radians only for a better gyro, so set it
    to the Earth's rate plus a bound of the bias where that is known."""

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
    """Return the sentences of all warnings, each once. Raises `UnfitRecording` with those of all refusals."""
    refusals = _sentences(fitness, Severity.REFUSE)
    if refusals:
        raise UnfitRecording(f"recording {recording_id}: {'; '.join(refusals)}")
    return _sentences(fitness, Severity.WARN)


def _sentences(fitness: Sequence[ChannelFitness], severity: Severity) -> tuple[str, ...]:
    return tuple(dict.fromkeys(f.sentence for c in fitness for f in c.findings if f.severity is severity))
