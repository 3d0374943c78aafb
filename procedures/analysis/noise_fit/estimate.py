"""Results of a noise fit of one channel. SI units; *rate* as in `core.noise`."""

from dataclasses import dataclass

from procedures.analysis.noise_fit.lines import SpectralLine
from procedures.core.arrays import Array
from procedures.core.noise import NoiseCoefficients

PROCESSES = ("quantization", "random_walk", "bias_instability", "rate_random_walk", "rate_ramp")


@dataclass(frozen=True)
class Estimate:
    """Estimate of one noise coefficient; value, uncertainty and interval are None where the process was not
    observed.
    """

    value: float | None
    """Q [rate·s], N [rate·√s], B [rate], K [rate/√s] or |R| [rate/s]."""
    standard_uncertainty: float | None
    """Standard uncertainty, given that only the observed processes are present."""
    lower: float | None
    upper: float | None
    """Interval at the fit's confidence, whichever other processes are present."""
    upper_limit: float
    """The coefficient is below this with a probability of 95 % (one-sided), observed or not; infinite: no limit."""
    p_value: float
    """Probability of evidence at least this strong in a record without this process."""

    described: bool = True
    """False: the noise model does not describe the part of the spectrum that determines this coefficient."""

    @property
    def present(self) -> bool:
        """True if the process was observed."""
        return self.value is not None


@dataclass(frozen=True)
class Followed:
    """A regressor of the slow part that the rate follows (a temperature, a shift), with its slope."""

    index: int
    """Index among the given regressors, from 0."""
    slope: float
    """Rate per unit of the regressor."""
    standard_uncertainty: float
    p_value: float


@dataclass(frozen=True)
class GaussMarkov:
    """An exponentially correlated process ``dx/dt = −x/τ + q·w``, w white of unit density."""

    time_s: float
    """Correlation time τ [s]."""
    time_sd_s: float | None
    """Standard uncertainty; None where the record determines no more than the order of magnitude."""
    driving: float
    """Driving noise q [rate/√s]."""
    driving_sd: float | None
    white: float | None = None
    """Random walk N above the process's frequencies, where the record does not tell whether that is the channel's own
    or a reader's behind a filter: below them it is `low_frequency_walk`."""

    @property
    def low_frequency_walk(self) -> float:
        """Random walk of averaging times far above τ, √(N² + q²τ²) [rate·√s]."""
        return ((self.white or 0.0) ** 2 + (self.driving * self.time_s) ** 2) ** 0.5

    @property
    def sd(self) -> float:
        """Standard deviation of the process, q·√(τ/2) [rate]."""
        return self.driving * (0.5 * self.time_s) ** 0.5


@dataclass(frozen=True)
class Octave:
    """Goodness of fit of the model between two frequencies."""

    low_hz: float
    high_hz: float
    chi_square: float
    dof: int
    p_value: float
    is_fast: bool
    """True: from the full-rate samples; False: from the cell means."""
    fitted: bool
    """False: left out of the fit."""


@dataclass(frozen=True)
class NoiseFit:
    """The noise of one channel by one method."""

    method: str
    quantization: Estimate
    random_walk: Estimate
    bias_instability: Estimate
    rate_random_walk: Estimate
    rate_ramp: Estimate
    slope: float
    """Signed slope of the rate where a ramp was observed, else 0 [rate/s]."""
    confidence: float
    correlated: tuple[str, ...]
    """The processes observed, in the order of `correlation`."""
    correlation: Array
    """Correlation of the errors of their coefficients, (p, p)."""
    octaves: tuple[Octave, ...]
    """Goodness of fit from low to high frequency; empty where the method has none."""
    lines: tuple[SpectralLine, ...]
    """Spectral lines that were cut out before the fit."""
    band_hz: tuple[float, float]
    """Lowest and highest frequency used."""
    remarks: tuple[str, ...]
    """Warnings to the reader, a sentence each."""
    notes: tuple[str, ...] = ()
    """Notes on processes that one record does not distinguish; the intervals allow for it."""
    followed: tuple[Followed, ...] = ()
    """The regressors, other than a ramp, that were kept."""
    gauss_markov: GaussMarkov | None = None
    """The Gauss–Markov process added to the five processes, if any."""
    flicker_corner_s: float | None = None
    """Shortest relaxation time of the flicker, where it is another than that of `core.noise`."""

    def of(self, process: str) -> Estimate:
        """Return the estimate of one of `PROCESSES`, by its name."""
        estimates = (
            self.quantization,
            self.random_walk,
            self.bias_instability,
            self.rate_random_walk,
            self.rate_ramp,
        )
        return estimates[PROCESSES.index(process)]

    def coefficients(self) -> NoiseCoefficients:
        """Return the values as coefficients, zero where a process was not observed."""
        q, n, b, k, r = (self.of(process).value or 0.0 for process in PROCESSES)
        return NoiseCoefficients(q, n, b, k, r)
