"""Result of `thermal_cycle`. Written by `generate_results.py`; do not edit."""

from typing import Literal

from bench_client.results.part import Part, ResultHead
from bench_client.results.shared import AxisCorrection, Check, Statement, ThermalCorrection, Verdict
from bench_client.results.shared_by_two import GyroThermalCorrection


class LegEvidence(Part):
    """Recorded evidence of one leg; times since the recording's beginning [s]."""

    target_c: float
    """Temperature of the soak by the plan [°C]"""
    ramp_c_min: float
    """Rate of the chamber's set point [°C/min]"""
    began_s: float
    """Beginning of the ramp, since the recording began [s]"""
    reached_s: float | None
    """Time when the chamber's air was first near the target [s]"""
    soaked_s: float | None
    """Time when the criterion began to hold for good [s]"""
    ended_s: float
    """End of the soak, since the recording began [s]"""
    case_c: float
    """Mean temperature of the case over the criterion's window at the end of the soak [°C]"""
    converter_c: float
    """Mean temperature of the converter over the criterion's window at the end of the soak [°C]"""
    case_slope_c_min: float
    """Drift of the case's temperature at the end of the soak [°C/min]"""
    converter_slope_c_min: float
    """Drift of the converter's temperature at the end of the soak [°C/min]"""
    air_c: float
    """Last reading of the chamber's air [°C]"""


class LegRegime(Part):
    """Regime switching observed by the indicator in one leg of the profile."""

    ramp_began_s: float | None
    """Time when the chamber's set point began to move; None where it stood [s]"""
    ramp_ended_s: float | None
    """End of the ramp, since the recording began [s]"""
    dynamic_s: float | None
    """Time when the regime became dynamic; None where it was dynamic before the ramp began, or did not [s]"""
    static_s: float | None
    """Time when the regime became static for the rest of the leg; None where it did not [s]"""
    onset_delay_s: float | None
    """Time from the ramp's beginning to the dynamic regime [s]"""
    chatter: int
    """Changes to dynamic that no ramp explains."""


class Trace(Part):
    """Plot data of a run: means over `step_s`, lists of equal length."""

    t_s: tuple[float, ...]
    """Middles since the recording's beginning [s]"""
    dynamic: tuple[bool, ...]
    """True where any second of the step was dynamic."""
    sensors_c: tuple[tuple[float, ...], ...]
    """Case, converter, gyros x, y, z [°C]"""
    air_c: tuple[float, ...]
    """Temperature of the chamber's air [°C]"""
    set_point_c: tuple[float, ...]
    """Set point of the chamber [°C]"""
    acceleration_c_s2: tuple[float, ...]
    """Second derivative of the case temperature by the indicator [°C/s²]."""
    before_m_s2: tuple[tuple[float, ...], ...]
    """Outputs over K0 less those of the reference soak, x, y, z: the error of an uncorrected unit [m/s²]"""
    after_m_s2: tuple[tuple[float, ...], ...]
    """Corrected forces less those of the reference soak [m/s²]"""
    magnitude_before_m_s2: tuple[float, ...]
    """|ĝ| − g with K0 and B0 alone [m/s²]"""
    magnitude_after_m_s2: tuple[float, ...]
    """Magnitude of the forces after correction, less its mean [m/s²]"""


class RunFound(Part):
    """Observations of one run: its recorded temperatures and the regimes that the indicator found."""

    recording: str
    """Recording, by its id"""
    name: str
    """Name"""
    up: int
    """Index of the unit's axis that stood upwards: 0 x, 1 y, 2 z"""
    duration_s: float
    """Duration [s]"""
    force_m_s2: tuple[float, ...]
    """Effective force along each axis that the fit took as known [m/s²]"""
    legs: tuple[LegEvidence, ...]
    """Legs in order: a ramp and its soak"""
    regimes: tuple[LegRegime, ...]
    """Regime of temperature of each leg"""
    static_share: float
    """Part of the run in the static regime"""
    trace: Trace
    """Course of the run, thinned for drawing"""


class AxisFound(Part):
    """Fit of one accelerometer's correction: coefficients, residuals, tests of the polynomial order."""

    correction: AxisCorrection
    """The correction"""
    uncertainties: tuple[float, ...]
    """Standard uncertainties of α1 … α4, β1 … β4."""
    residual_sd_m_s2: tuple[float | None, ...]
    """Residual standard deviations of the cells, static and dynamic [m/s²]"""
    effective_samples: float
    """Number of independent samples that correlated noise leaves"""
    condition: float
    """Condition number of the column-scaled design"""
    bic: tuple[float, ...]
    """Bayesian criterion of orders 1 … 5."""
    p_values: tuple[float, ...]
    """F test of order 2 against 1, of 3 against 2, …"""
    preferred_order: int
    """Order that the information criterion prefers"""
    order_reason: str = ""
    """Reason for or against the second order, in a sentence."""


class SoakFound(Part):
    """Errors of one soak, root mean square over the runs (thesis table 4.5)."""

    leg: int
    """Leg of the cycle, from 1"""
    target_c: float
    """Temperature of the soak by the plan [°C]"""
    case_c: float
    """Temperature of the unit's case [°C]"""
    runs: int
    """Number of runs in which the unit was static long enough."""
    before_m_s2: tuple[float, ...]
    """Three-sigma error: three times the rms departure from the run's reference soak [m/s²]"""
    after_m_s2: tuple[float, ...]
    """Three times the departure from the reference soak, after correction [m/s²]"""
    spread_before_m_s2: tuple[float, ...]
    """3σ about the soak's own mean [m/s²]"""
    spread_after_m_s2: tuple[float, ...]
    """Three times the spread about the soak's own mean, after correction [m/s²]"""


class FormFound(Part):
    """Performance of one correction form on this cycle."""

    form: str
    """"both", "switched", "single", "normalised polynomial (C)", or "the unit's current correction"."""
    worst_3_sigma_m_s2: tuple[float, ...]
    """Worst 3σ over the soaks, axis by axis [m/s²]"""
    magnitude_static_m_s2: float
    """Rms of |ĝ| about each run's mean, over the runs, in the static regime [m/s²]"""
    magnitude_dynamic_m_s2: float
    """Rms of |ĝ| about each run's mean, over the runs, in the dynamic regime [m/s²]"""


class CorrelationFound(Part):
    """Correlation of one channel of one run with a temperature."""

    run: str
    """Run of the thermal cycle, by name"""
    axis: str
    """Axis of the unit"""
    r: float
    """Coefficient of correlation"""
    effective_samples: float
    """Number of independent samples that correlated noise leaves"""
    slope: float
    """[m/s² or rad/s a °C]"""
    slope_sd: float
    """Standard uncertainty of the slope"""
    p_value: float
    """p-value: probability that noise alone gives a statistic at least this large"""


class AccelerometerCorrelation(Part):
    """Correlation of an accelerometer with temperature, before and after correction (thesis table 4.3)."""

    before: CorrelationFound
    """Correlation before correction"""
    after: CorrelationFound
    """Correlation after correction"""


class GyroTemperature(Part):
    """Test of a gyro's independence of its temperature, over three runs together (thesis table 4.6)."""

    axis: str
    """Axis of the unit"""
    runs: tuple[CorrelationFound, ...]
    """Runs of the cycle"""
    p_value: float
    """Joint p-value of the runs by Fisher's method."""
    slope_rad_s_c: float
    """Weighted slope over the runs [rad/s/°C]"""
    slope_sd_rad_s_c: float
    """Standard uncertainty of that slope [rad/s/°C]"""


class GyroNoise(Part):
    """Noise of one gyro in one run (thesis table 4.7), with the unit's known noise to compare. None as a
    coefficient: not observed.
    """

    run: str
    """Run of the thermal cycle, by name"""
    axis: str
    """Axis of the unit"""
    quantization: float | None
    """Quantization noise Q"""
    random_walk: float | None
    """Random walk N"""
    bias_instability: float | None
    """Bias instability B"""
    uncertainties: tuple[float | None, ...]
    """Standard uncertainties of Q, N and B; null: not observed"""
    upper_limits: tuple[float | None, ...]
    """Upper limits of Q, N and B (95 %, one-sided), observed or not; None: unbounded."""
    known: tuple[float, ...] | None
    """Q, N and B of the unit's record, for comparison; null: not known"""


class AllanFound(Part):
    """Allan deviations of one accelerometer in one run, of means over a second."""

    run: str
    """Run of the thermal cycle, by name"""
    axis: str
    """Axis of the unit"""
    tau_s: tuple[float, ...]
    """Averaging times [s]"""
    before: tuple[float, ...]
    """Deviation at each averaging time, before correction"""
    after: tuple[float, ...]
    """Deviation at each averaging time, after correction"""
    lower: tuple[float, ...]
    """Lower end of the confidence interval of `after`."""
    upper: tuple[float, ...]
    """Upper end of the confidence interval of `after`."""
    rise: float
    """Largest ratio of a lower end to the upper end at any shorter time: above one the deviation surely rises."""


class Following(Part):
    """Law by which the converter's sensor follows the case's: delay, lag, heating, with uncertainties."""

    delay_s: float
    """Board's own delay Δ [s]"""
    delay_sd_s: float
    """Standard uncertainty of the delay [s]"""
    total_delay_s: float
    """Delay of reading behind reading on a steady ramp, ``Δ + τ_b − τ_c``: the Δt of thesis fig. 3.15 [s]"""
    total_delay_sd_s: float
    """Standard uncertainty of the total delay [s]"""
    sensor_lag_s: float
    """Time constant τ_b of the converter's sensor, beside the case sensor's as it was given [s]"""
    sensor_lag_sd_s: float
    """Its standard uncertainty, with that of the case sensor's time constant [s]"""
    heating_c: tuple[float, ...]
    """Warmth h of the board over the case in each run [°C]."""
    residual_sd_c: float
    """Spread of the cells about the law [°C]"""
    p_value: float
    """Chance of as much drift about the law as the slow residuals show, were they the readings' own noise."""


class Hysteresis(Part):
    """Corrected accelerometer at one temperature, reached from below less reached from above, in one run."""

    run: str
    """Run of the thermal cycle, by name"""
    axis: str
    """Axis of the unit"""
    target_c: float
    """Temperature of the soak by the plan [°C]"""
    difference_m_s2: float
    """Corrected output reached from below less that reached from above [m/s²]"""
    standard_uncertainty_m_s2: float
    """Standard uncertainty [m/s²]"""
    p_value: float
    """Chance of as large a difference by noise: the unit's where it is known, else that of the fit's residuals."""


class GyroCorrected(Part):
    """Correction of a gyro that depends on temperature."""

    axis: str
    """Axis of the unit"""
    order: int
    """Order of the polynomial"""
    reason: str
    """Reason, as a sentence"""
    p_before: float
    """p-value of the dependence before correction"""
    p_after: float | None
    """p-value of "no dependence is left" in each run, corrected by a fit to the others; None with a single run."""


class ThermalCycle(Part):
    """Complete results of a thermal cycle."""

    judged: str
    """Judged correction: "fit" of this cycle, or "current" of the unit, which has not seen this cycle."""
    reference_c: tuple[float, ...]
    """Readings of case and converter sensor at which the correction changes nothing but K0 and B0 [°C]"""
    stage_one: bool
    """True if the converter's own model was taken out first."""
    force_known: bool
    """True if the forces come from the unit's calibration."""
    regime_delay_s: float
    """Delay of the regime indicator itself [s]"""
    runs: tuple[RunFound, ...]
    """Runs of the cycle"""
    axes: tuple[AxisFound, ...]
    """Axis fits of the form that was fitted."""
    correction: ThermalCorrection
    """Thermal correction fitted to this cycle."""
    soaks: tuple[SoakFound, ...]
    """Soak errors under the judged correction."""
    magnitude_m_s2: tuple[tuple[float, ...], ...]
    """Rms of |ĝ| about its mean in each run, before and after correction [m/s²]"""
    forms: tuple[FormFound, ...]
    """Forms of the correction, compared on this cycle"""
    accelerometers: tuple[AccelerometerCorrelation, ...]
    """Accelerometers' dependence on temperature, one entry an axis"""
    gyros: tuple[GyroTemperature, ...]
    """Gyros, one entry an axis"""
    gyro_noise: tuple[GyroNoise, ...]
    """Noise of the gyros in the cycle"""
    allan: tuple[AllanFound, ...]
    """Allan deviations"""
    warnings: tuple[str, ...]
    """What to know before believing the numbers, as sentences"""
    following: Following | None = None
    """Delay of the converter's sensor, found from the readings; None where it was not found."""
    converter_lag_s: float | None = None
    """Time constant of the converter's sensor that the fit was given [s]"""
    thermometers: bool = False
    """True if the unit's sensors were corrected by its current calibration of thermometers."""
    hysteresis: tuple[Hysteresis, ...] = ()
    """Difference between soaks reached from below and from above"""
    gyro_correction: GyroThermalCorrection | None = None
    """For gyros that depend on temperature; None where none does."""
    gyros_corrected: tuple[GyroCorrected, ...] = ()
    """Gyros with a dependence, and what a correction leaves"""


class ThermalCycleDocument(Part):
    """Thermal correction, and the performance of it and of the gyros over temperature."""

    checks: tuple[Check, ...] = ()
    """Values held to their limits"""
    verdict: Verdict
    """Verdict of all checks: pass, fail or error"""
    warnings: tuple[str, ...] = ()
    """What to know before believing the numbers, as sentences"""
    statement: Statement | None = None
    """Statement of conformity; null without checks and in results of older versions"""
    cycle: ThermalCycle
    """Everything that the thermal cycle found"""


class ThermalCycleResult(ResultHead):
    """A result: Thermal cycle."""

    kind: Literal["procedure"]
    name: Literal["thermal_cycle"]
    document: ThermalCycleDocument
