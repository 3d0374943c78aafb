"""Parts that three results or more have in common. Written by `generate_results.py`; do not edit."""

from typing import Literal

from bench_client.results.part import Part


class Limit(Part):
    """A requirement on one value, inclusive at both ends, and where it comes from."""

    unit: str
    maximum: float | None = None
    minimum: float | None = None
    source: str = ""


class Decision(Part):
    """How one value was decided."""

    rule: str
    outcome: Literal["pass", "conditional pass", "conditional fail", "fail"]
    expanded_uncertainty: float | None = None
    coverage_factor: float | None = None
    coverage_probability: float | None = None
    degrees_of_freedom: float | None = None
    guard_band: float = 0.0


class Check(Part):
    """Check of one value against one limit."""

    name: str
    value: float
    limit: Limit
    passed: bool
    standard_uncertainty: float | None = None
    note: str = ""
    degrees_of_freedom: float | None = None
    decision: Decision | None = None
    significance: bool = False


Verdict = Literal["pass", "fail", "error"]


class Statement(Part):
    """Statement of conformity of a whole result."""

    outcome: Literal["pass", "conditional pass", "conditional fail", "fail"]
    rule: str
    conditional: tuple[str, ...] = ()


class TriadCalibration(Part):
    """Calibration coefficients of one triad, with the covariance of their estimate.

    Plain tuples, so that the whole is JSON; `array` forms are the properties below. Order in `covariance`,
    12×12: as `COEFFICIENT_NAMES`. A coefficient that the method fixes (the lower triangle of a scalar
    calibration) has zero variance. Make one from arrays with `triad_calibration`.
    """

    triad: str
    output_unit: str
    input_unit: str
    bias: tuple[float, ...]
    matrix: tuple[tuple[float, ...], ...]
    covariance: tuple[tuple[float, ...], ...]
    model: str = "linear"


class CalibrationSummaryCoefficient(Part):
    """Coefficient of ``U = b + K·v`` with its standard uncertainty and the contributions to it."""

    name: str
    unit: str
    estimate: float
    standard_uncertainty: float
    from_noise: float
    from_table: float
    from_table_source: dict[str, float]


class StationResidual(Part):
    """Outputs minus model at one station, channels x, y, z, with their expected standard deviations."""

    label: str
    residual: tuple[float, ...]
    expected_sd: tuple[float, ...]


class Magnitudes(Part):
    """|v̂| at n stations before and after correction, in SI; plain tuples, JSON-ready."""

    triad: str
    unit: str
    reference: float
    labels: tuple[str, ...]
    before: tuple[float, ...] | None
    after: tuple[float, ...]
    expected_sd: tuple[float, ...]
    mean_error_before: float | None
    sd_before: float | None
    mean_error_after: float
    sd_after: float
    per_axis: float
    per_axis_sd: float


class ScalarParameter(Part):
    """Cross-check of one of the nine parameters: from magnitudes alone, from the linear fit, and their difference."""

    name: str
    unit: str
    scalar: float
    standard_uncertainty: float
    linear: float
    difference_sigmas: float


class ScalarCheck(Part):
    """The scalar calibration of the same stations, which trusts no angle of the table."""

    parameters: tuple[ScalarParameter, ...]
    condition: float
    p_value: float | None


class BudgetRow(Part):
    """One source of uncertainty of one coefficient."""

    source: str
    value: float
    unit: str
    distribution: Literal["normal", "rectangular"]
    divisor: float
    sensitivity: float
    contribution: float
    degrees_of_freedom: float | None


class Budget(Part):
    """Uncertainty budget of one coefficient."""

    coefficient: str
    unit: str
    rows: tuple[BudgetRow, ...]
    standard_uncertainty: float
    degrees_of_freedom: float | None
    coverage_factor: float
    expanded_uncertainty: float
    coverage_probability: float = 0.9545


class TriadSummary(Part):
    """Complete calibration results of one triad."""

    calibration: TriadCalibration
    coefficients: tuple[CalibrationSummaryCoefficient, ...]
    condition: float
    residuals: tuple[StationResidual, ...]
    chi_square: float
    degrees_of_freedom: int
    p_value: float | None
    noise_known: bool
    magnitudes: Magnitudes
    scalar: ScalarCheck | None = None
    weighting: Literal["noise_and_table", "noise"] = "noise"
    misfit: float | None = None
    worst: str = ""
    left_out: Magnitudes | None = None
    suspect: str = ""
    budgets: tuple[Budget, ...] = ()


Form = Literal["both", "switched", "single"]


class Normalised(Part):
    """Normalised function: ``value_0·F(t)`` with F(t_0) = 1 if `relative`, else ``value_0 + F(t)`` with F(t_0) =
    0.
    """

    relative: bool
    reference_c: float
    at_reference: float
    coefficients: tuple[float, ...]
    covariance: tuple[tuple[float, ...], ...]
    residual_sd: float


class ConverterModel(Part):
    """``N(I, t) = K0·Fc(t)·I + N0 + Fs(t)`` of one channel, t its own sensor's reading."""

    scale: Normalised
    zero: Normalised


class RatePoint(Part):
    """Scale factor of one axis at one rate and direction, as a departure from the fitted K."""

    axis: str
    rate_deg_s: float
    turns: int
    departure: float
    standard_uncertainty: float
    modelled: float


class WholeTurns(Part):
    """Complete results of whole turns for a gyro triad."""

    coefficients: tuple[CalibrationSummaryCoefficient, ...]
    calibration: TriadCalibration
    reference_rate_deg_s: float
    points: tuple[RatePoint, ...]
    condition: float
    chi_square: float
    degrees_of_freedom: int
    p_value: float | None
    noise_known: bool


class BandCurve(Part):
    """Least, mean and greatest Allan deviation over every start offset (paper A)."""

    tau_s: tuple[float, ...]
    least: tuple[float, ...]
    mean: tuple[float, ...]
    greatest: tuple[float, ...]


class Density(Part):
    """One-sided power spectral density ``S(f) = 2·P(f)·Δt`` [rate²/Hz]; all lists run parallel to `frequency_hz`.

    P is the mean power of a bin's modes and Δt the sampling period, so white noise of N [rate·√s] has 2N². Slow
    bins come from the cells of the whole record, fast ones from its segments; lines that were taken out are not
    in it.
    """

    frequency_hz: tuple[float, ...]
    density: tuple[float, ...]
    lower: tuple[float, ...]
    upper: tuple[float, ...]


class SensorCorrection(Part):
    """Correction of one temperature sensor about the set's reference."""

    channel: str
    offset_c: float
    slope: float


class ThermometerCorrection(Part):
    """Corrections of a unit's sensors. Raises `BadParameter` for numbers that are not finite or do not fit
    together.
    """

    sensors: tuple[SensorCorrection, ...]
    reference_c: float
    covariance: tuple[tuple[float, ...], ...]
    fitted_range_c: tuple[float, ...]
