"""What is found of one launch, channel by channel: plain values, SI, ready to be stored.

*Rate* is a channel's own: angular rate [rad/s], specific force [m/s²], or counts.
"""

from dataclasses import dataclass

PROCESSES = ("quantization", "random_walk", "bias_instability", "rate_random_walk", "rate_ramp")
"""Q [rate·s], N [rate·√s], B [rate], K [rate/√s], R [rate/s]: the attributes of `NoiseCoefficients`."""


@dataclass(frozen=True)
class Reading:
    """One coefficient by one way. `value` is None where the process was not observed."""

    value: float | None
    standard_uncertainty: float | None = None
    lower: float | None = None
    upper: float | None = None
    """Ends of the interval at the confidence asked for."""
    upper_limit: float | None = None
    """The coefficient is below this with a probability of 95 % (one-sided), observed or not."""
    p_value: float | None = None
    """How probable the data are without the process."""
    from_s: float | None = None
    to_s: float | None = None
    """Where on the plot a graphical value was read."""
    described: bool = True
    """False: the noise model does not describe the record where this is read; the limit holds whatever is there."""


@dataclass(frozen=True)
class SpectralLine:
    """A line that was taken out of the record before its noise was fitted."""

    frequency_hz: float
    amplitude: float
    """Of the sine [rate]."""


@dataclass(frozen=True)
class CorrelatedProcess:
    """A Gauss–Markov process ``dx/dt = −x/τ + q·w`` beside the five."""

    time_s: float
    time_sd_s: float | None
    driving: float
    """q [rate/√s]."""
    driving_sd: float | None
    sd: float
    """Of the process, q·√(τ/2) [rate]."""


@dataclass(frozen=True)
class TemperatureSlope:
    """How the channel follows a temperature beside it."""

    channel: str
    """The temperature's."""
    slope: float
    """[rate/K], of a temperature in °C; else a count of it."""
    standard_uncertainty: float
    p_value: float


@dataclass(frozen=True)
class LevelShift:
    """One shift of the level."""

    at_s: float
    """Since the launch."""
    height: float
    """[rate]"""
    standard_uncertainty: float


@dataclass(frozen=True)
class Coefficient:
    """One noise process three ways."""

    process: str
    graphical: Reading
    least_squares: Reading
    likelihood: Reading


@dataclass(frozen=True)
class Curve:
    """An overlapping Allan deviation with its intervals; lists go with `tau_s`."""

    tau_s: tuple[float, ...]
    deviation: tuple[float, ...]
    lower: tuple[float, ...]
    upper: tuple[float, ...]
    edf: tuple[float, ...]


@dataclass(frozen=True)
class BandCurve:
    """Least, mean and greatest Allan deviation over every start offset (paper A)."""

    tau_s: tuple[float, ...]
    least: tuple[float, ...]
    mean: tuple[float, ...]
    greatest: tuple[float, ...]


@dataclass(frozen=True)
class Stage:
    """The channel after one step of the analysis: what each step changes is seen from stage to stage."""

    name: str
    """"as recorded", "trimmed", "self-heating removed", "kept by the wavelet split", "removed by the wavelet split"."""
    curve: Curve
    readings: tuple[float | None, ...]
    """Q, N, B, K, R read off its curve; None: no such line."""
    note: str = ""


@dataclass(frozen=True)
class Trend:
    """Moving means of the rate, and the curve fitted to them; time since launch."""

    t_s: tuple[float, ...]
    rate: tuple[float, ...]
    fitted: tuple[float, ...] = ()


@dataclass(frozen=True)
class Exponential:
    """One term ``amplitude·exp(−t/time)``, t since the first sample that is analysed [s]."""

    amplitude: float
    amplitude_sd: float
    time_s: float
    time_sd: float


@dataclass(frozen=True)
class Transient:
    """The transient at the start of a launch, times since the launch."""

    shape: str
    """"one exponential", "two exponentials", "raised cosine" or "ended exponential"."""
    amplitude: float
    """At the first sample [rate]."""
    amplitude_sd: float
    end_s: float
    """Where it falls below `level` for good."""
    end_sd_s: float
    has_ended: bool
    """Within the record."""
    level: float
    """[rate]: a tenth of the noise's Allan deviation at 70 s."""
    p_value: float
    """How probable so much of a transient is in noise alone."""


@dataclass(frozen=True)
class SelfHeating:
    """F(t) = Σ amplitude·e^(−t/time) + constant (thesis 3.1.3), subtracted as F(t) − F(t₀)."""

    terms: tuple[Exponential, ...]
    """One or two, the slower first."""
    constant: float
    constant_sd: float
    p_value: float
    """How probable so much of the last term is in noise and the other term alone."""


@dataclass(frozen=True)
class Averaging:
    """Where the quantization line falls below the rest; None where it does nowhere, with the reason."""

    time_s: float | None
    standard_uncertainty_s: float | None
    reason: str = ""


@dataclass(frozen=True)
class ChannelNoise:
    """Everything that is found of one channel in one launch."""

    channel: str
    rate_unit: str
    mean: float
    """Of the rate, over what was analysed."""
    used_from_s: float
    """Time since launch from which on the channel was analysed."""
    used_s: float
    findings: tuple[str, ...]
    """What the inspection of the samples says."""
    warm_up: Transient | None
    self_heating: SelfHeating | None
    trend: Trend
    stages: tuple[Stage, ...]
    band: BandCurve
    coefficients: tuple[Coefficient, ...]
    disagreements: tuple[str, ...]
    model: tuple[str, ...]
    """What the likelihood's model does not describe: spectral lines, frequencies left out."""
    averaging: Averaging
    warnings: tuple[str, ...] = ()
    """Those of `model` that a reader must know; the rest are notes on what one record does not tell apart."""
    bandwidth_hz: float = 0.0
    """Half of the rate of the samples: a random walk is that of noise so wide, unless a filter's edge is named."""
    band_hz: tuple[float, float] = (0.0, 0.0)
    """Lowest and highest frequency that the likelihood uses."""
    lines: tuple[SpectralLine, ...] = ()
    correlated: CorrelatedProcess | None = None
    flicker_corner_s: float | None = None
    """Shortest relaxation time of the flicker, where it is not the one of the noise model."""
    temperature: TemperatureSlope | None = None
    shift: LevelShift | None = None

    def coefficient(self, process: str) -> Coefficient:
        """One of the five processes."""
        return self.coefficients[PROCESSES.index(process)]

    @property
    def analysed(self) -> Stage:
        """The stage that the coefficients are of: the last before the wavelet split."""
        return [s for s in self.stages if "wavelet" not in s.name][-1]


@dataclass(frozen=True)
class LaunchNoise:
    """One launch: which recording, how long, and its channels."""

    recording: str
    label: str
    rate_hz: float
    duration_s: float
    since_launch_s: float
    channels: tuple[ChannelNoise, ...]
