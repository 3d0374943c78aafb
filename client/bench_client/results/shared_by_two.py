"""Parts that two results have in common. Written by `generate_results.py`; do not edit."""

from typing import Literal

from bench_client.results.part import Part
from bench_client.results.shared import (
    BandCurve,
    Check,
    Density,
    DwellsSaved,
    Statement,
    ThermalShare,
    ThermometerCorrection,
    TriadCalibration,
    TriadSummary,
    Verdict,
    WholeTurns,
)


class FerrarisCalibrationDocument(Part):
    """Gyros from rests and turns, accelerometers from the rests."""

    checks: tuple[Check, ...] = ()
    """Values held to their limits"""
    verdict: Verdict
    """Verdict of all checks: pass, fail or error"""
    warnings: tuple[str, ...] = ()
    """What to know before believing the numbers, as sentences"""
    statement: Statement | None = None
    """Statement of conformity; null without checks and in results of older versions"""
    gyro: WholeTurns
    """Gyro triad"""
    accelerometer: TriadSummary
    """Accelerometer triad"""


class TermEstimate(Part):
    """One further coefficient with its standard uncertainty, and the decision whether it is present."""

    kind: Literal["quadratic", "asymmetry", "g_sensitivity"]
    """Kind of the term"""
    name: str
    """Name"""
    unit: str
    """Unit of measurement"""
    estimate: float
    """Estimated value, in `unit`"""
    standard_uncertainty: float
    """Standard uncertainty, in the unit of the value"""
    p_value: float
    """Chance of an estimate at least as far from zero without the term."""
    present: bool
    """Whether the term was found in the data"""


class Extended(Part):
    """A triad's calibration with its further terms, all fitted at once."""

    calibration: TriadCalibration
    """Calibration of the triad"""
    terms: tuple[TermEstimate, ...]
    """Further terms, with uncertainty and p-value"""
    condition: float
    """Condition number of the column-scaled design"""
    chi_square: float
    """Weighted sum of squared residuals"""
    degrees_of_freedom: int
    """Degrees of freedom"""
    p_value: float | None
    """None: the noise is not known or no equation is spare, so nothing is judged."""


class MultiPositionCalibrationDocument(Part):
    """Calibration of each triad, and of those with further terms the extended one, which then counts."""

    checks: tuple[Check, ...] = ()
    """Values held to their limits"""
    verdict: Verdict
    """Verdict of all checks: pass, fail or error"""
    warnings: tuple[str, ...] = ()
    """What to know before believing the numbers, as sentences"""
    statement: Statement | None = None
    """Statement of conformity; null without checks and in results of older versions"""
    triads: tuple[TriadSummary, ...]
    """Triads, one entry each"""
    extended: tuple[Extended, ...] = ()
    """Fits with further terms, of each triad for which they were asked"""
    thermal: ThermalShare | None = None
    """thermal correction of the accelerometers, where it was applied"""
    dwells: DwellsSaved | None = None
    """dwells ended by the stop rule, and the time saved"""


class Transient(Part):
    """The transient at the start of a launch, times since the launch."""

    shape: str
    """"one exponential", "two exponentials", "raised cosine" or "ended exponential"."""
    amplitude: float
    """Amplitude at the first sample [rate]."""
    amplitude_sd: float
    """Standard uncertainty of the amplitude"""
    end_s: float
    """Time after which it stays below `level` [s]"""
    end_sd_s: float
    """Standard uncertainty of the end [s]"""
    has_ended: bool
    """True if it ends within the record."""
    level: float
    """[rate]: a tenth of the noise's Allan deviation at 70 s"""
    p_value: float
    """Probability that noise alone shows a transient of this strength."""


class Exponential(Part):
    """One term ``amplitude·exp(−t/time)``, t since the first sample that is analysed [s]."""

    amplitude: float
    """Amplitude, in the channel's unit"""
    amplitude_sd: float
    """Standard uncertainty of the amplitude"""
    time_s: float
    """Time constant [s]"""
    time_sd: float
    """Standard uncertainty of the time constant, in seconds"""


class SelfHeating(Part):
    """F(t) = Σ amplitude·e^(−t/time) + constant (thesis 3.1.3), subtracted as F(t) − F(t₀)."""

    terms: tuple[Exponential, ...]
    """One or two, the slower first."""
    constant: float
    """Constant part of the curve"""
    constant_sd: float
    """Standard uncertainty of the constant part"""
    p_value: float
    """Probability that noise and the other term alone show a last term of this strength."""


class Trend(Part):
    """Moving means of the rate, and the curve fitted to them; time since launch."""

    t_s: tuple[float, ...]
    """Time since the recording began [s]"""
    rate: tuple[float, ...]
    """Mean rate of the channel at each time"""
    fitted: tuple[float, ...] = ()
    """Fitted drift at each time"""


class LaunchResultsCurve(Part):
    """An overlapping Allan deviation with its intervals; all lists run parallel to `tau_s`."""

    tau_s: tuple[float, ...]
    """Averaging times [s]"""
    deviation: tuple[float, ...]
    """Deviation at each averaging time, in the channel's unit"""
    lower: tuple[float, ...]
    """Lower end of the interval"""
    upper: tuple[float, ...]
    """Upper end of the interval"""
    edf: tuple[float, ...]
    """Equivalent degrees of freedom at each averaging time"""


class Stage(Part):
    """The channel after one step of the analysis; successive stages show the effect of each step."""

    name: str
    """"as recorded", "trimmed", "self-heating removed", "kept by the wavelet split", "removed by the wavelet
    split".
    """
    curve: LaunchResultsCurve
    """Allan deviation at this stage of the analysis"""
    readings: tuple[float | None, ...]
    """Q, N, B, K, R read off its curve; None: no such line."""
    note: str = ""
    """Remark, for people"""


class Reading(Part):
    """One coefficient by one method. `value` is None where the process was not observed."""

    value: float | None
    """Value, in `unit` where there is one"""
    standard_uncertainty: float | None = None
    """Standard uncertainty, in the unit of the value"""
    lower: float | None = None
    """Lower end of the interval at the requested confidence."""
    upper: float | None = None
    """Upper end of the interval at the requested confidence; None with a lower end: it is infinite."""
    upper_limit: float | None = None
    """The coefficient is below this with a probability of 95 % (one-sided), observed or not; None where
    `unbounded`, and where the method gives none.
    """
    p_value: float | None = None
    """Probability of such data without the process."""
    from_s: float | None = None
    """Shortest averaging time of the reading [s]"""
    to_s: float | None = None
    """Range of cluster times on the plot where a graphical value was read [s]"""
    described: bool = True
    """False: the noise model does not describe the part of the record that determines this; the limit still holds."""
    unbounded: bool = False
    """True: no finite limit holds the coefficient from above, however large it is the record could hide it."""


class LaunchResultsCoefficient(Part):
    """One noise process of a channel as the three methods find it: graphical, least squares, likelihood."""

    process: str
    """Noise process"""
    graphical: Reading
    """Coefficient read off the plot; its value is null without a straight stretch"""
    least_squares: Reading
    """Coefficient by a non-negative fit of the deviation; its value is null where it is absent"""
    likelihood: Reading
    """Coefficient by the likelihood of the spectrum, the efficient estimate"""


class Averaging(Part):
    """Averaging time from which on quantization lies below the rest; None, with the reason, where there is none."""

    time_s: float | None
    """Averaging time; null: none [s]"""
    standard_uncertainty_s: float | None
    """Standard uncertainty [s]"""
    reason: str = ""
    """Reason, as a sentence"""


class SpectralLine(Part):
    """A line that was removed from the record before its noise was fitted."""

    frequency_hz: float
    """Frequency [Hz]"""
    amplitude: float
    """Amplitude of the sine [rate]."""
    origin: str = ""
    """The dither that it belongs to, by the unit's declared frequencies; empty where none are declared."""


class CorrelatedProcess(Part):
    """A Gauss–Markov process ``dx/dt = −x/τ + q·w`` in addition to the five."""

    time_s: float
    """Correlation time [s]"""
    time_sd_s: float | None
    """Standard uncertainty of the correlation time [s]"""
    driving: float
    """Driving noise q [rate/√s]."""
    driving_sd: float | None
    """Standard uncertainty of the driving noise"""
    sd: float
    """Standard deviation of the process, q·√(τ/2) [rate]."""


class TemperatureSlope(Part):
    """Dependence of the channel on a recorded temperature."""

    channel: str
    """Name of the temperature channel."""
    slope: float
    """[rate/K] for a temperature in °C, else rate per count of it"""
    standard_uncertainty: float
    """Standard uncertainty, in the unit of the value"""
    p_value: float
    """p-value: probability that noise alone gives a statistic at least this large"""


class LevelShift(Part):
    """One shift of the rate's level: time, height, uncertainty."""

    at_s: float
    """Time since the launch [s]"""
    height: float
    """Height of the shift [rate]."""
    standard_uncertainty: float
    """Standard uncertainty, in the unit of the value"""


class TemperatureCorrelation(Part):
    """Correlation of a channel with one temperature over a launch; the noise is the channel's own, most likely
    one.
    """

    sensor: str
    """Temperature channel that was used"""
    r: float
    """Pearson's coefficient of the means."""
    slope: float
    """[rate/K] for a temperature in °C, else rate per count of it"""
    slope_sd: float
    """Standard uncertainty, which allows for the autocorrelation of the channel's noise."""
    effective_samples: float
    """Number of independent samples that correlated noise leaves"""
    p_value: float
    """Chance of as steep a slope from that noise alone."""


class Vibration(Part):
    """Root mean square of a channel between two frequencies, its own noise taken out."""

    from_hz: float
    """Lower edge of the band [Hz]"""
    to_hz: float
    """Upper edge of the band [Hz]"""
    total: float
    """With the channel's noise [rate]."""
    own_noise: float
    """Root mean square of the fitted quantization, random walk and flicker in that band [rate]."""
    vibration: float
    """``√(total² − own_noise²)``; zero where the noise explains all [rate]."""
    lines: float
    """Root mean square of the lines in that band, part of `total` [rate]."""


class ChannelNoise(Part):
    """All results of one channel in one launch."""

    channel: str
    """Name of the channel"""
    rate_unit: str
    """Unit of the channel as a rate"""
    mean: float
    """Mean rate over the analysed part of the record."""
    used_from_s: float
    """Time since launch from which on the channel was analysed [s]"""
    used_s: float
    """Length of the launch that the analysis used [s]"""
    findings: tuple[str, ...]
    """Sentences of the inspection of the samples."""
    warm_up: Transient | None
    """Warm-up found at the launch; null: none"""
    self_heating: SelfHeating | None
    """Curve of self-heating that was fitted; null: none"""
    trend: Trend
    """Slow drift of the channel over the launch"""
    stages: tuple[Stage, ...]
    """Steps of the analysis, with curve and readings"""
    band: BandCurve
    """Least, mean and greatest deviation over every start (paper A)"""
    coefficients: tuple[LaunchResultsCoefficient, ...]
    """Coefficients, with their uncertainties where they are estimates"""
    disagreements: tuple[str, ...]
    """Coefficients on which the three readings differ, as sentences"""
    model: tuple[str, ...]
    """Sentences on features that the likelihood's model does not describe: spectral lines, excluded frequencies."""
    averaging: Averaging
    """Averaging time at which quantization falls below the other noise"""
    warnings: tuple[str, ...] = ()
    """The warnings in `model`; its other sentences are notes on processes that one record cannot distinguish."""
    bandwidth_hz: float = 0.0
    """Half of the sampling rate: the bandwidth to which a random walk refers, unless a filter's edge is named [Hz]"""
    band_hz: tuple[float, ...] = (0.0, 0.0)
    """Lowest and highest frequency that the likelihood uses [Hz]"""
    lines: tuple[SpectralLine, ...] = ()
    """Spectral lines"""
    correlated: CorrelatedProcess | None = None
    """Gauss-Markov process found in the noise; null: none"""
    flicker_corner_s: float | None = None
    """Shortest relaxation time of the flicker, where it is not the one of the noise model [s]"""
    temperature: TemperatureSlope | None = None
    """Dependence of the launch on temperature; null: no sensor"""
    shift: LevelShift | None = None
    """Shift of the level found in the launch; null: none"""
    density: Density | None = None
    """Power spectral density of what the coefficients refer to; None in results of earlier versions."""
    temperatures: tuple[TemperatureCorrelation, ...] = ()
    """Correlation with each temperature recorded at the same time; empty where there is none."""
    vibration: Vibration | None = None
    """Root mean square above 1 Hz; None where the launch was not sampled so fast, or in earlier versions."""


class LaunchNoise(Part):
    """Noise of one launch: recording, duration, and the results of its channels."""

    recording: str
    """Recording, by its id"""
    label: str
    """Name for people"""
    rate_hz: float
    """Sample rate [Hz]"""
    duration_s: float
    """Duration [s]"""
    since_launch_s: float
    """Time from switching on to the first sample [s]"""
    channels: tuple[ChannelNoise, ...]
    """Channels, in order"""


class MeanCoefficient(Part):
    """One noise process over all launches, by the likelihood fit."""

    process: str
    """Noise process"""
    values: tuple[Reading, ...]
    """One reading per launch."""
    mean: float | None
    """Mean over the launches; one that does not show the process counts as zero. None where none shows it."""
    sd: float | None
    """Standard uncertainty of the mean: the greater of that from the fits and that from the scatter of the
    launches.
    """


class ChannelSummary(Part):
    """Summary of one channel over all launches: mean coefficients, averaging time, change of the mean."""

    channel: str
    """Name of the channel"""
    rate_unit: str
    """Unit of the channel as a rate"""
    means: tuple[MeanCoefficient, ...]
    """Mean of each noise coefficient over the launches"""
    averaging_time_s: float | None
    """Averaging time at which quantization falls below the other noise [s]"""
    mean_change_sd: float | None
    """Sample standard deviation (n − 1) of the mean rate over the launches; None for a single launch."""


class GyroPolynomial(Part):
    """Polynomial of one gyro; empty where it does not depend on temperature."""

    coefficients: tuple[float, ...] = ()
    """Coefficients c_1, c_2, … [rad/s/°C^k]."""
    covariance: tuple[tuple[float, ...], ...] = ()
    """Covariance matrix of the coefficients, in their order"""


class GyroThermalCorrection(Part):
    """Polynomials of x, y, z about one reference temperature."""

    gyros: tuple[GyroPolynomial, ...]
    """Gyros, one entry an axis"""
    reference_c: float
    """Temperature at which the correction does nothing [°C]"""
    fitted_range_c: tuple[float, ...]
    """Lowest and highest temperature of the gyros' sensors in the fit [°C]"""
    thermometers: ThermometerCorrection | None = None
    """Taken out of the sensors' readings before the fit, and so wherever it is used; None: readings as they are."""
