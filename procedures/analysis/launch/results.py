"""Results of the analysis of one launch, channel by channel: plain values in SI, ready to be stored.

*Rate* is a channel's own: angular rate [rad/s], specific force [m/s²], or counts.
"""

from dataclasses import dataclass

from procedures.analysis.launch.density import Density
from procedures.analysis.launch.lines import SpectralLine
from procedures.analysis.launch.surroundings import TemperatureCorrelation, Vibration

PROCESSES = ("quantization", "random_walk", "bias_instability", "rate_random_walk", "rate_ramp")
"""Q [rate·s], N [rate·√s], B [rate], K [rate/√s], R [rate/s]: the attributes of `NoiseCoefficients`."""


@dataclass(frozen=True)
class Reading:
    """One coefficient by one method. `value` is None where the process was not observed."""

    value: float | None
    standard_uncertainty: float | None = None
    lower: float | None = None
    """Lower end of the interval at the requested confidence."""
    upper: float | None = None
    """Upper end of the interval at the requested confidence; None with a lower end: it is infinite."""
    upper_limit: float | None = None
    """The coefficient is below this with a probability of 95 % (one-sided), observed or not; None where `unbounded`,
    and where the method gives none."""
    p_value: float | None = None
    """Probability of such data without the process."""
    from_s: float | None = None
    to_s: float | None = None
    """Range of cluster times on the plot where a graphical value was read."""
    described: bool = True
    """False: the noise model does not describe the part of the record that determines this; the limit still holds."""
    unbounded: bool = False
    """True: no finite limit holds the coefficient from above, however large it is the record could hide it."""


@dataclass(frozen=True)
class CorrelatedProcess:
    """A Gauss–Markov process ``dx/dt = −x/τ + q·w`` in addition to the five."""

    time_s: float
    time_sd_s: float | None
    driving: float
    """Driving noise q [rate/√s]."""
    driving_sd: float | None
    sd: float
    """Standard deviation of the process, q·√(τ/2) [rate]."""


@dataclass(frozen=True)
class TemperatureSlope:
    """Dependence of the channel on a recorded temperature."""

    channel: str
    """Name of the temperature channel."""
    slope: float
    """[rate/K] for a temperature in °C, else rate per count of it."""
    standard_uncertainty: float
    p_value: float


@dataclass(frozen=True)
class LevelShift:
    """One shift of the rate's level: time, height, uncertainty."""

    at_s: float
    """Time since the launch."""
    height: float
    """Height of the shift [rate]."""
    standard_uncertainty: float


@dataclass(frozen=True)
class Coefficient:
    """One noise process of a channel as the three methods find it: graphical, least squares, likelihood."""

    process: str
    graphical: Reading
    least_squares: Reading
    likelihood: Reading


@dataclass(frozen=True)
class Curve:
    """An overlapping Allan deviation with its intervals; all lists run parallel to `tau_s`."""

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
    """The channel after one step of the analysis; successive stages show the effect of each step."""

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
    """Amplitude at the first sample [rate]."""
    amplitude_sd: float
    end_s: float
    """Time after which it stays below `level`."""
    end_sd_s: float
    has_ended: bool
    """True if it ends within the record."""
    level: float
    """[rate]: a tenth of the noise's Allan deviation at 70 s."""
    p_value: float
    """Probability that noise alone shows a transient of this strength."""


@dataclass(frozen=True)
class SelfHeating:
    """F(t) = Σ amplitude·e^(−t/time) + constant (thesis 3.1.3), subtracted as F(t) − F(t₀)."""

    terms: tuple[Exponential, ...]
    """One or two, the slower first."""
    constant: float
    constant_sd: float
    p_value: float
    """Probability that noise and the other term alone show a last term of this strength."""


@dataclass(frozen=True)
class Averaging:
    """Averaging time from which on quantization lies below the rest; None, with the reason, where there is none."""

    time_s: float | None
    standard_uncertainty_s: float | None
    reason: str = ""


@dataclass(frozen=True)
class ChannelNoise:
    """All results of one channel in one launch."""

    channel: str
    rate_unit: str
    mean: float
    """Mean rate over the analysed part of the record."""
    used_from_s: float
    """Time since launch from which on the channel was analysed."""
    used_s: float
    findings: tuple[str, ...]
    """Sentences of the inspection of the samples."""
    warm_up: Transient | None
    self_heating: SelfHeating | None
    trend: Trend
    stages: tuple[Stage, ...]
    band: BandCurve
    coefficients: tuple[Coefficient, ...]
    disagreements: tuple[str, ...]
    model: tuple[str, ...]
    """Sentences on features that the likelihood's model does not describe: spectral lines, excluded frequencies."""
    averaging: Averaging
    warnings: tuple[str, ...] = ()
    """The warnings in `model`; its other sentences are notes on processes that one record cannot distinguish."""
    bandwidth_hz: float = 0.0
    """Half of the sampling rate: the bandwidth to which a random walk refers, unless a filter's edge is named."""
    band_hz: tuple[float, float] = (0.0, 0.0)
    """Lowest and highest frequency that the likelihood uses."""
    lines: tuple[SpectralLine, ...] = ()
    correlated: CorrelatedProcess | None = None
    flicker_corner_s: float | None = None
    """Shortest relaxation time of the flicker, where it is not the one of the noise model."""
    temperature: TemperatureSlope | None = None
    shift: LevelShift | None = None
    density: Density | None = None
    """Power spectral density of what the coefficients refer to; None in results of earlier versions."""
    temperatures: tuple[TemperatureCorrelation, ...] = ()
    """Correlation with each temperature recorded at the same time; empty where there is none."""
    vibration: Vibration | None = None
    """Root mean square above 1 Hz; None where the launch was not sampled so fast, or in earlier versions."""

    def coefficient(self, process: str) -> Coefficient:
        """Return the coefficient of one of the five processes, by its name."""
        return self.coefficients[PROCESSES.index(process)]

    @property
    def analysed(self) -> Stage:
        """The stage that the coefficients refer to: the last before the wavelet split."""
        return [s for s in self.stages if "wavelet" not in s.name][-1]


@dataclass(frozen=True)
class LaunchNoise:
    """Noise of one launch: recording, duration, and the results of its channels."""

    recording: str
    label: str
    rate_hz: float
    duration_s: float
    since_launch_s: float
    channels: tuple[ChannelNoise, ...]
