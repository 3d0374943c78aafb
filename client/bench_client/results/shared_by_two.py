"""Parts that two results have in common. Written by `generate_results.py`; do not edit."""

from typing import Literal

from bench_client.results.part import Part
from bench_client.results.shared import (
    BandCurve,
    Check,
    ConverterModel,
    Density,
    Form,
    Statement,
    ThermometerCorrection,
    TriadCalibration,
    TriadSummary,
    Verdict,
    WholeTurns,
)


class FerrarisCalibrationDocument(Part):
    """Gyros from rests and turns, accelerometers from the rests."""

    checks: tuple[Check, ...] = ()
    verdict: Verdict
    warnings: tuple[str, ...] = ()
    statement: Statement | None = None
    """None without checks and in results of older versions"""
    gyro: WholeTurns
    accelerometer: TriadSummary


class TermEstimate(Part):
    """One coefficient with its standard uncertainty and the decision whether it is there."""

    kind: Literal["quadratic", "asymmetry", "g_sensitivity"]
    name: str
    unit: str
    estimate: float
    standard_uncertainty: float
    p_value: float
    present: bool


class Extended(Part):
    """A triad's calibration with its further terms, all fitted at once."""

    calibration: TriadCalibration
    terms: tuple[TermEstimate, ...]
    condition: float
    chi_square: float
    degrees_of_freedom: int
    p_value: float | None


class MultiPositionCalibrationDocument(Part):
    """Calibration of each triad, and of those with further terms the extended one, which then counts."""

    checks: tuple[Check, ...] = ()
    verdict: Verdict
    warnings: tuple[str, ...] = ()
    statement: Statement | None = None
    """None without checks and in results of older versions"""
    triads: tuple[TriadSummary, ...]
    extended: tuple[Extended, ...] = ()


class Transient(Part):
    """The transient at the start of a launch, times since the launch."""

    shape: str
    amplitude: float
    amplitude_sd: float
    end_s: float
    end_sd_s: float
    has_ended: bool
    level: float
    p_value: float


class Exponential(Part):
    """One term ``amplitude·exp(−t/time)``, t since the first sample that is analysed [s]."""

    amplitude: float
    amplitude_sd: float
    time_s: float
    time_sd: float


class SelfHeating(Part):
    """F(t) = Σ amplitude·e^(−t/time) + constant (thesis 3.1.3), subtracted as F(t) − F(t₀)."""

    terms: tuple[Exponential, ...]
    constant: float
    constant_sd: float
    p_value: float


class Trend(Part):
    """Moving means of the rate, and the curve fitted to them; time since launch."""

    t_s: tuple[float, ...]
    rate: tuple[float, ...]
    fitted: tuple[float, ...] = ()


class LaunchResultsCurve(Part):
    """An overlapping Allan deviation with its intervals; all lists run parallel to `tau_s`."""

    tau_s: tuple[float, ...]
    deviation: tuple[float, ...]
    lower: tuple[float, ...]
    upper: tuple[float, ...]
    edf: tuple[float, ...]


class Stage(Part):
    """The channel after one step of the analysis; successive stages show the effect of each step."""

    name: str
    curve: LaunchResultsCurve
    readings: tuple[float | None, ...]
    note: str = ""


class Reading(Part):
    """One coefficient by one method. `value` is None where the process was not observed."""

    value: float | None
    standard_uncertainty: float | None = None
    lower: float | None = None
    upper: float | None = None
    upper_limit: float | None = None
    p_value: float | None = None
    from_s: float | None = None
    to_s: float | None = None
    described: bool = True


class LaunchResultsCoefficient(Part):
    """One noise process by the three methods."""

    process: str
    graphical: Reading
    least_squares: Reading
    likelihood: Reading


class Averaging(Part):
    """Averaging time from which on quantization lies below the rest; None, with the reason, where there is none."""

    time_s: float | None
    standard_uncertainty_s: float | None
    reason: str = ""


class SpectralLine(Part):
    """A line that was removed from the record before its noise was fitted."""

    frequency_hz: float
    amplitude: float
    origin: str = ""


class CorrelatedProcess(Part):
    """A Gauss–Markov process ``dx/dt = −x/τ + q·w`` in addition to the five."""

    time_s: float
    time_sd_s: float | None
    driving: float
    driving_sd: float | None
    sd: float


class TemperatureSlope(Part):
    """Dependence of the channel on a recorded temperature."""

    channel: str
    slope: float
    standard_uncertainty: float
    p_value: float


class LevelShift(Part):
    """One shift of the rate's level."""

    at_s: float
    height: float
    standard_uncertainty: float


class TemperatureCorrelation(Part):
    """Correlation of a channel with one temperature over a launch; the noise is the channel's own, most likely
    one.
    """

    sensor: str
    r: float
    slope: float
    slope_sd: float
    effective_samples: float
    p_value: float


class Vibration(Part):
    """Root mean square of a channel between two frequencies, its own noise taken out."""

    from_hz: float
    to_hz: float
    total: float
    own_noise: float
    vibration: float
    lines: float


class ChannelNoise(Part):
    """All results of one channel in one launch."""

    channel: str
    rate_unit: str
    mean: float
    used_from_s: float
    used_s: float
    findings: tuple[str, ...]
    warm_up: Transient | None
    self_heating: SelfHeating | None
    trend: Trend
    stages: tuple[Stage, ...]
    band: BandCurve
    coefficients: tuple[LaunchResultsCoefficient, ...]
    disagreements: tuple[str, ...]
    model: tuple[str, ...]
    averaging: Averaging
    warnings: tuple[str, ...] = ()
    bandwidth_hz: float = 0.0
    band_hz: tuple[float, ...] = (0.0, 0.0)
    lines: tuple[SpectralLine, ...] = ()
    correlated: CorrelatedProcess | None = None
    flicker_corner_s: float | None = None
    temperature: TemperatureSlope | None = None
    shift: LevelShift | None = None
    density: Density | None = None
    temperatures: tuple[TemperatureCorrelation, ...] = ()
    vibration: Vibration | None = None


class LaunchNoise(Part):
    """Noise of one launch: recording, duration, and the results of its channels."""

    recording: str
    label: str
    rate_hz: float
    duration_s: float
    since_launch_s: float
    channels: tuple[ChannelNoise, ...]


class MeanCoefficient(Part):
    """One noise process over all launches, by the likelihood fit."""

    process: str
    values: tuple[Reading, ...]
    mean: float | None
    sd: float | None


class ChannelSummary(Part):
    """Summary of one channel over all launches."""

    channel: str
    rate_unit: str
    means: tuple[MeanCoefficient, ...]
    averaging_time_s: float | None
    mean_change_sd: float | None


class AxisCorrection(Part):
    """Thesis 4.1 of one accelerometer. α in 1/°C (α2, α4) and 1/°C², β in m/s² a °C (β1, β3) and a °C²."""

    scale: float
    bias_m_s2: float
    alpha: tuple[float, ...] = (0.0, 0.0, 0.0, 0.0)
    beta: tuple[float, ...] = (0.0, 0.0, 0.0, 0.0)
    case_reference_c: float = 20.0
    converter_reference_c: float = 20.0
    form: Form = "both"
    dynamic_offset: tuple[float, ...] = (0.0, 0.0)
    covariance: tuple[tuple[float, ...], ...] = ()


class TemperatureRange(Part):
    """Between which readings of its two sensors a correction was fitted [°C]. Raises `BadParameter`."""

    case_c: tuple[float, ...]
    converter_c: tuple[float, ...]


class ThermalCorrection(Part):
    """Thesis 4.1 of a triad, x, y, z."""

    triad: str
    axes: tuple[AxisCorrection, ...]
    first_stage: tuple[ConverterModel, ...] | None = None
    fitted_range: TemperatureRange | None = None
    thermometers: ThermometerCorrection | None = None
    static_sensors: Literal["case", "gyros"] = "case"


class GyroPolynomial(Part):
    """Polynomial of one gyro; empty where it does not depend on temperature."""

    coefficients: tuple[float, ...] = ()
    covariance: tuple[tuple[float, ...], ...] = ()


class GyroThermalCorrection(Part):
    """Polynomials of x, y, z about one reference temperature."""

    gyros: tuple[GyroPolynomial, ...]
    reference_c: float
    fitted_range_c: tuple[float, ...]
    thermometers: ThermometerCorrection | None = None
