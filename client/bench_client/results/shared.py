"""Parts that three results or more have in common. Written by `generate_results.py`; do not edit."""

from typing import Literal

from bench_client.results.part import Part


class Limit(Part):
    """A requirement on one value, inclusive at both ends, and where it comes from."""

    unit: str
    """Unit of measurement"""
    maximum: float | None = None
    """Largest value; as a limit, null: none"""
    minimum: float | None = None
    """Smallest value; as a limit, null: none"""
    source: str = ""
    """Where the limit comes from"""


class Decision(Part):
    """How one value was decided: rule, outcome, expanded uncertainty, guard band."""

    rule: str
    """Rule in words; a test of significance is held at its level, without a guard band."""
    outcome: Literal["pass", "conditional pass", "conditional fail", "fail", "inconclusive"]
    """Outcome: pass, fail, conditional pass, conditional fail or inconclusive"""
    expanded_uncertainty: float | None = None
    """Expanded uncertainty U in the limit's unit; None: the value has no stated uncertainty."""
    coverage_factor: float | None = None
    """Coverage factor k of U = k·u"""
    coverage_probability: float | None = None
    """Coverage probability of U"""
    degrees_of_freedom: float | None = None
    """Degrees of freedom of u; None: so many that they do not count, or no uncertainty."""
    guard_band: float = 0.0
    """Guard band w in the limit's unit."""


class Check(Part):
    """Check of one value against one limit: passed or not, with its uncertainty and the decision."""

    name: str
    """Name"""
    value: float | None
    """Value in the limit's unit; None: an upper bound that is infinite, as nothing bounds what was not observed."""
    limit: Limit
    """Limit that the value is held to"""
    passed: bool
    """Whether the value is within its limit"""
    standard_uncertainty: float | None = None
    """Standard uncertainty, in the unit of the value"""
    note: str = ""
    """Remark, for people"""
    degrees_of_freedom: float | None = None
    """Degrees of freedom of the standard uncertainty; None: so many that they do not count."""
    decision: Decision | None = None
    """Rule by which it was decided, and the expanded uncertainty; None in results of versions before it."""
    significance: bool = False
    """True for a test of significance: the value is a p-value and the limit its level."""
    bound: bool = False
    """True: nothing was observed, and the value is what it stays below; a value of None: it is unbounded."""


Verdict = Literal["pass", "fail", "error"]


class Statement(Part):
    """Statement of conformity of a whole result."""

    outcome: Literal["pass", "conditional pass", "conditional fail", "fail", "inconclusive"]
    """The verdict, conditional where some value lies within its expanded uncertainty of the limit."""
    rule: str
    """Decision rule in words."""
    conditional: tuple[str, ...] = ()
    """Checks whose values lie within their expanded uncertainty of the limit."""


class TriadCalibration(Part):
    """Calibration coefficients of one triad, with the covariance of their estimate.

    Plain tuples, so that the whole is JSON; `array` forms are the properties below. Order in `covariance`,
    12×12: as `COEFFICIENT_NAMES`. A coefficient that the method fixes (the lower triangle of a scalar
    calibration) has zero variance. Make one from arrays with `triad_calibration`.
    """

    triad: str
    """Triad by its name, either "gyro" or "accelerometer"."""
    output_unit: str
    """Unit of the output U and of b: "rad/s", "m/s^2" or "count"."""
    input_unit: str
    """Unit of the input v, "rad/s" or "m/s^2"."""
    bias: tuple[float, ...]
    """Bias b, in the output unit"""
    matrix: tuple[tuple[float, ...], ...]
    """Matrix K, row by row"""
    covariance: tuple[tuple[float, ...], ...]
    """Covariance matrix of the coefficients, in their order"""
    model: str = "linear"
    """"linear" (full K against known vectors), "scalar" (K upper triangular, magnitude as the only reference),
    "field" (K diagonal; cross-couplings zero with the spread that was declared) or "entered" (typed by a
    person).
    """


class CalibrationSummaryCoefficient(Part):
    """Coefficient of ``U = b + K·v`` with its standard uncertainty and the contributions to it."""

    name: str
    """Name"""
    unit: str
    """Unit of measurement"""
    estimate: float
    """Estimated value, in `unit`"""
    standard_uncertainty: float
    """Standard uncertainty, in the unit of the value"""
    from_noise: float
    """Part of the standard uncertainty by noise"""
    from_table: float
    """Part of the standard uncertainty by the table's errors"""
    from_table_source: dict[str, float]
    """The table's part by source: orthogonality, level, azimuth, gravity, pointing."""


class StationResidual(Part):
    """Outputs minus model at one station, channels x, y, z, and the expected standard deviation of each residual."""

    label: str
    """Name for people"""
    residual: tuple[float, ...]
    """Output less model, channels x, y, z"""
    expected_sd: tuple[float, ...]
    """Expected standard deviation"""


class Magnitudes(Part):
    """|v̂| at n stations before and after correction, in SI; plain tuples, JSON-ready."""

    triad: str
    """Triad: gyro or accelerometer"""
    unit: str
    """Unit of measurement"""
    reference: float
    """Reference value: gravity or the Earth's rate"""
    labels: tuple[str, ...]
    """Stations, in order"""
    before: tuple[float, ...] | None
    """Magnitudes before correction; None where the outputs are in counts, which have none."""
    after: tuple[float, ...]
    """Magnitude at each station, after correction"""
    expected_sd: tuple[float, ...]
    """Standard deviations of the errors after correction; empty where the noise is not known."""
    mean_error_before: float | None
    """Mean error before correction"""
    sd_before: float | None
    """Standard deviation before correction"""
    mean_error_after: float
    """Mean error after correction"""
    sd_after: float
    """Sample standard deviation over the stations, n − 1 (Tables 5.3, 5.4)."""
    per_axis: float
    """Error per axis ``δ/√3`` (thesis 5.1): one axis's share, all three taken as alike."""
    per_axis_sd: float
    """Standard uncertainty of that figure, ``δ/√(2(n − 1))/√3``: independent errors of n stations."""


class ScalarParameter(Part):
    """Cross-check of one of the nine parameters: from magnitudes alone, from the linear fit, and their difference."""

    name: str
    """Name"""
    unit: str
    """Unit of measurement"""
    scalar: float
    """Value from the magnitudes alone"""
    standard_uncertainty: float
    """Standard uncertainty, in the unit of the value"""
    linear: float
    """Value from the linear fit"""
    difference_sigmas: float
    """Difference in standard deviations of the difference, both estimates' common data allowed for."""


class ScalarCheck(Part):
    """The scalar calibration of the same stations, which trusts no angle of the table."""

    parameters: tuple[ScalarParameter, ...]
    """The nine parameters by both ways"""
    condition: float
    """Condition number of the column-scaled design"""
    p_value: float | None
    """p-value: probability that noise alone gives a statistic at least this large"""


class BudgetRow(Part):
    """One source of uncertainty of one coefficient: value, distribution, divisor, sensitivity, contribution."""

    source: str
    """Source of uncertainty"""
    value: float
    """Value of the source in `unit`: a standard deviation, or the limit of a rectangular distribution."""
    unit: str
    """Unit of measurement"""
    distribution: Literal["normal", "rectangular"]
    """Distribution of the source: normal or rectangular"""
    divisor: float
    """Divisor from the stated value to a standard uncertainty"""
    sensitivity: float
    """Change of the coefficient [its unit] per `unit` of the source."""
    contribution: float
    """``|c|·u(x)`` in the coefficient's unit."""
    degrees_of_freedom: float | None
    """None: infinite, the value is taken as known."""


class Budget(Part):
    """Uncertainty budget of one coefficient: rows by source, and the expanded uncertainty."""

    coefficient: str
    """Name of the coefficient, such as gyro.K11"""
    unit: str
    """Unit of measurement"""
    rows: tuple[BudgetRow, ...]
    """Rows, one for each source"""
    standard_uncertainty: float
    """Root sum of squares of the contributions."""
    degrees_of_freedom: float | None
    """Effective degrees of freedom by Welch and Satterthwaite; None: infinite."""
    coverage_factor: float
    """Coverage factor k of U = k·u"""
    expanded_uncertainty: float
    """Expanded uncertainty U = k·u"""
    coverage_probability: float = 0.9545
    """Coverage probability of U"""


class TriadSummary(Part):
    """Complete calibration results of one triad: coefficients, residuals, tests, magnitudes, budgets. JSON-ready."""

    calibration: TriadCalibration
    """Calibration of the triad"""
    coefficients: tuple[CalibrationSummaryCoefficient, ...]
    """Coefficients, with their uncertainties where they are estimates"""
    condition: float
    """Condition number of the column-scaled design"""
    residuals: tuple[StationResidual, ...]
    """Residuals at the stations, in their order"""
    chi_square: float
    """Weighted sum of squared residuals"""
    degrees_of_freedom: int
    """Degrees of freedom"""
    p_value: float | None
    """p-value: probability that noise alone gives a statistic at least this large"""
    noise_known: bool
    """Whether the noise is that of the unit's record"""
    magnitudes: Magnitudes
    """Errors of the magnitude at the stations"""
    scalar: ScalarCheck | None = None
    """Cross-check by the magnitudes alone; null: not made"""
    weighting: Literal["noise_and_table", "noise"] = "noise"
    """Weights of the fit; results of procedure versions before 1.1.0 lack the field and were weighted by noise."""
    misfit: float | None = None
    """Residuals over what noise and table allow; None without a spare equation and in results of older versions."""
    worst: str = ""
    """Station and channel with the greatest residual."""
    left_out: Magnitudes | None = None
    """Magnitudes out of sample, each station corrected by the fit of the others; None where that cannot be made."""
    suspect: str = ""
    """The flaw of the reference that the residuals look like, as a sentence; empty where they are as declared."""
    budgets: tuple[Budget, ...] = ()
    """Uncertainty budget of each coefficient; empty in results of older versions."""


Form = Literal["both", "switched", "single"]


class ThermalShare(Part):
    """Effect of the thermal correction on a calibration, JSON-ready."""

    form: Form
    """Form of the thermal correction"""
    regime: str
    """Regime assumed by the form ``switched``: "static"; empty for the other forms, which need none."""
    case_c: tuple[float, ...]
    """Case temperature at each station [°C]"""
    converter_c: tuple[float, ...]
    """Temperature of the unit's signal converter at each station [°C]"""
    change_m_s2: tuple[tuple[float, ...], ...]
    """Correction added to the outputs x, y, z of each station [m/s²]"""
    from_correction: dict[str, float]
    """Standard uncertainty that the correction's coefficients leave in each calibration coefficient; it is part of
    theirs.
    """
    from_sensors: dict[str, float]
    """Standard uncertainty due to the temperature sensors' noise."""


class DwellEnded(Part):
    """Duration of one dwell under a stop rule."""

    label: str
    """Name for people"""
    duration_s: float
    """Duration [s]"""
    longest_s: float
    """Longest allowed dwell [s]"""
    by_rule: bool
    """True if the rule ended it; False if it ran to its longest time."""


class DwellsSaved(Part):
    """Time that a stop rule saved in a job."""

    dwells: tuple[DwellEnded, ...]
    """Dwells, in order"""
    saved_s: float
    """Sum of what the dwells were shorter than their longest time [s]"""
    share: float
    """Part of the longest time of all dwells together."""


class Normalised(Part):
    """Normalised function: ``value_0·F(t)`` with F(t_0) = 1 if `relative`, else ``value_0 + F(t)`` with F(t_0) =
    0.
    """

    relative: bool
    """Whether the values are relative to that at the reference"""
    reference_c: float
    """Reference temperature t_0, at which F has its reference value [°C]"""
    at_reference: float
    """Value at the reference value_0, in the unit of the values."""
    coefficients: tuple[float, ...]
    """a_1 … a_q of F, in 1/°C^k, or in the unit of the values a °C^k."""
    covariance: tuple[tuple[float, ...], ...]
    """Covariance of value_0, a_1 … a_q, (q + 1, q + 1)."""
    residual_sd: float
    """Standard deviation of the residuals"""


class ConverterModel(Part):
    """``N(I, t) = K0·Fc(t)·I + N0 + Fs(t)`` of one channel, t its own sensor's reading."""

    scale: Normalised
    """Scale K0 [codes a mA] and Fc."""
    zero: Normalised
    """Zero N0 [codes] and Fs, the change."""


class RatePoint(Part):
    """Scale factor of one axis at one rate and direction, as a departure from the fitted K."""

    axis: str
    """Axis of the unit"""
    rate_deg_s: float
    """Signed table rate [deg/s]."""
    turns: int
    """Number of whole turns, signed"""
    departure: float
    """Departure ``(y − b·T − K·E)/(2πn·K·e) − 1``, relative: the sum of asymmetry and nonlinearity."""
    standard_uncertainty: float
    """Standard uncertainty of noise and table at this station alone."""
    modelled: float
    """Departure predicted by the fitted terms."""


class WholeTurns(Part):
    """Complete results of whole turns for a gyro triad."""

    coefficients: tuple[CalibrationSummaryCoefficient, ...]
    """Coefficients, with their uncertainties where they are estimates"""
    calibration: TriadCalibration
    """b and K with their covariance; the terms beyond the linear ones are not part of it."""
    reference_rate_deg_s: float
    """Rate at which the quadratic and the cubic term have the given sizes [deg/s]"""
    points: tuple[RatePoint, ...]
    """Points, in order"""
    condition: float
    """Condition number of the column-scaled design"""
    chi_square: float
    """Weighted sum of squared residuals"""
    degrees_of_freedom: int
    """Degrees of freedom"""
    p_value: float | None
    """p-value: probability that noise alone gives a statistic at least this large"""
    noise_known: bool
    """Whether the noise is that of the unit's record"""
    budgets: tuple[Budget, ...] = ()
    """Uncertainty budget of each coefficient; empty in results of older versions."""


class BandCurve(Part):
    """Least, mean and greatest Allan deviation over every start offset (paper A)."""

    tau_s: tuple[float, ...]
    """Averaging times [s]"""
    least: tuple[float, ...]
    """Least deviation over every start"""
    mean: tuple[float, ...]
    """Mean deviation over every start"""
    greatest: tuple[float, ...]
    """Greatest deviation over every start"""


class Density(Part):
    """One-sided power spectral density ``S(f) = 2·P(f)·Δt`` [rate²/Hz]; all lists run parallel to `frequency_hz`.

    P is the mean power of a bin's modes and Δt the sampling period, so white noise of N [rate·√s] has 2N². Slow
    bins come from the cells of the whole record, fast ones from its segments; lines that were taken out are not
    in it.
    """

    frequency_hz: tuple[float, ...]
    """Frequency [Hz]"""
    density: tuple[float, ...]
    """Power spectral density at each frequency, one-sided"""
    lower: tuple[float, ...]
    """Lower end of the interval at the requested confidence, by chi-square of each bin's degrees of freedom."""
    upper: tuple[float, ...]
    """Upper end of the interval at the requested confidence, by chi-square of each bin's degrees of freedom."""


class AxisCorrection(Part):
    """Thesis 4.1 of one accelerometer. α in 1/°C (α2, α4) and 1/°C², β in m/s² a °C (β1, β3) and a °C²."""

    scale: float
    """K0, m/s² a m/s² of nominal output."""
    bias_m_s2: float
    """Offset B0, which is *added*: minus the output at zero input, at the reference temperatures [m/s²]"""
    alpha: tuple[float, ...] = (0.0, 0.0, 0.0, 0.0)
    """Temperature coefficients α1 … α4 of the scale factor (thesis 4.1)"""
    beta: tuple[float, ...] = (0.0, 0.0, 0.0, 0.0)
    """Temperature coefficients β1 … β4 of the bias (thesis 4.1)"""
    case_reference_c: float = 20.0
    """Reading of the case (gyro) sensor at the standard calibration [°C]"""
    converter_reference_c: float = 20.0
    """Reading of the converter's sensor at which the correction does nothing [°C]"""
    form: Form = "both"
    """Form of the thermal correction"""
    dynamic_offset: tuple[float, ...] = (0.0, 0.0)
    """Change of K0 and B0 in the dynamic regime, for the form ``switched`` alone."""
    covariance: tuple[tuple[float, ...], ...] = ()
    """Covariance of α1 … α4, β1 … β4, (8, 8); rows of what the form does not use are zero. Empty: not known."""


class TemperatureRange(Part):
    """Between which readings of its two sensors a correction was fitted [°C]. Raises `BadParameter`."""

    case_c: tuple[float, ...]
    """Lowest and highest reading of the case's sensor [°C]"""
    converter_c: tuple[float, ...]
    """Lowest and highest reading of the converter's sensor [°C]"""


class SensorCorrection(Part):
    """Correction of one temperature sensor about the set's reference."""

    channel: str
    """Name of the channel"""
    offset_c: float
    """Reading less temperature at the reference [°C]."""
    slope: float
    """Change of the offset by reading [°C/°C]."""


class ThermometerCorrection(Part):
    """Corrections of a unit's sensors. Raises `BadParameter` for numbers that are not finite or do not fit
    together.
    """

    sensors: tuple[SensorCorrection, ...]
    """Thermometers, one entry each"""
    reference_c: float
    """Reading at which the error is the offset alone [°C]"""
    covariance: tuple[tuple[float, ...], ...]
    """Covariance of offset and slope of the first sensor, of the second, …, (2m, 2m)."""
    fitted_range_c: tuple[float, ...]
    """Lowest and highest temperature of the soaks; beyond them the lines are extrapolated [°C]"""


class ThermalCorrection(Part):
    """Thesis 4.1 of a triad, x, y, z."""

    triad: str
    """Triad: gyro or accelerometer"""
    axes: tuple[AxisCorrection, ...]
    """Correction of each axis, x, y, z"""
    first_stage: tuple[ConverterModel, ...] | None = None
    """The converter's models that were taken out of the outputs before the fit (`core.converter.at_reference`),
    and so must be wherever the correction is used; None: it is for outputs as they are. The reference of the
    whole is then these models' for the converter's own drift, and the axes' for the rest: best the same.
    """
    fitted_range: TemperatureRange | None = None
    """Temperature range of the fit; beyond it the correction extrapolates. None: not known (older versions)."""
    thermometers: ThermometerCorrection | None = None
    """Correction of the sensors that was taken out of their readings before the fit, and so must be wherever the
    correction is used: its temperatures are then temperatures. None: they are readings.
    """
    static_sensors: Literal["case", "gyros"] = "case"
    """Sensor of the static terms: the case's for all axes, or the thermometer of each axis' own gyro (thesis 4.1)."""
