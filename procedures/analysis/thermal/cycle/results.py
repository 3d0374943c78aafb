"""Results of a thermal cycle, as plain JSON-ready numbers. SI but for °C; axes in the order x, y, z."""

from dataclasses import dataclass

from procedures.analysis.thermal.following import Following
from procedures.analysis.thermal.profile_progress import LegEvidence
from procedures.core.temperature.gyros import GyroThermalCorrection
from procedures.core.thermal_correction import AxisCorrection, ThermalCorrection

Triple = tuple[float, float, float]


@dataclass(frozen=True)
class Trace:
    """Plot data of a run: means over `step_s`, lists of equal length."""

    t_s: tuple[float, ...]
    """Middles since the recording's beginning."""
    dynamic: tuple[bool, ...]
    """True where any second of the step was dynamic."""
    sensors_c: tuple[tuple[float, ...], ...]
    """Case, converter, gyros x, y, z."""
    air_c: tuple[float, ...]
    set_point_c: tuple[float, ...]
    acceleration_c_s2: tuple[float, ...]
    """Second derivative of the case temperature by the indicator [°C/s²]."""
    before_m_s2: tuple[tuple[float, ...], ...]
    """Outputs over K0 less those of the reference soak, x, y, z: the error of an uncorrected unit."""
    after_m_s2: tuple[tuple[float, ...], ...]
    """Corrected forces less those of the reference soak."""
    magnitude_before_m_s2: tuple[float, ...]
    """|ĝ| − g with K0 and B0 alone."""
    magnitude_after_m_s2: tuple[float, ...]


@dataclass(frozen=True)
class LegRegime:
    """Regime switching observed by the indicator in one leg of the profile."""

    ramp_began_s: float | None
    """Time when the chamber's set point began to move; None where it stood."""
    ramp_ended_s: float | None
    dynamic_s: float | None
    """Time when the regime became dynamic; None where it was dynamic before the ramp began, or did not."""
    static_s: float | None
    """Time when the regime became static for the rest of the leg; None where it did not."""
    onset_delay_s: float | None
    chatter: int
    """Changes to dynamic that no ramp explains."""


@dataclass(frozen=True)
class RunFound:
    """Observations of one run: its recorded temperatures and the regimes that the indicator found."""

    recording: str
    name: str
    up: int
    duration_s: float
    force_m_s2: Triple
    """Effective force along each axis that the fit took as known."""
    legs: tuple[LegEvidence, ...]
    regimes: tuple[LegRegime, ...]
    static_share: float
    trace: Trace


@dataclass(frozen=True)
class AxisFound:
    """Fit of one accelerometer's correction: coefficients, residuals, tests of the polynomial order."""

    correction: AxisCorrection
    uncertainties: tuple[float, ...]
    """Standard uncertainties of α1 … α4, β1 … β4."""
    residual_sd_m_s2: tuple[float | None, float | None]
    """Residual standard deviations of the cells, static and dynamic."""
    effective_samples: float
    condition: float
    bic: tuple[float, ...]
    """Bayesian criterion of orders 1 … 5."""
    p_values: tuple[float, ...]
    """F test of order 2 against 1, of 3 against 2, …"""
    preferred_order: int
    order_reason: str = ""
    """Reason for or against the second order, in a sentence."""


@dataclass(frozen=True)
class SoakFound:
    """Errors of one soak, root mean square over the runs (thesis table 4.5)."""

    leg: int
    target_c: float
    case_c: float
    runs: int
    """Number of runs in which the unit was static long enough."""
    before_m_s2: Triple
    """Three-sigma error: three times the rms departure from the run's reference soak."""
    after_m_s2: Triple
    spread_before_m_s2: Triple
    """3σ about the soak's own mean."""
    spread_after_m_s2: Triple


@dataclass(frozen=True)
class FormFound:
    """Performance of one correction form on this cycle."""

    form: str
    """"both", "switched", "single", "normalised polynomial (C)", or "the unit's current correction"."""
    worst_3_sigma_m_s2: Triple
    """Worst 3σ over the soaks, axis by axis."""
    magnitude_static_m_s2: float
    """Rms of |ĝ| about each run's mean, over the runs, in the static regime."""
    magnitude_dynamic_m_s2: float
    """Rms of |ĝ| about each run's mean, over the runs, in the dynamic regime."""


@dataclass(frozen=True)
class CorrelationFound:
    """Correlation of one channel of one run with a temperature."""

    run: str
    axis: str
    r: float
    effective_samples: float
    slope: float
    """[m/s² or rad/s a °C]."""
    slope_sd: float
    p_value: float


@dataclass(frozen=True)
class AccelerometerCorrelation:
    """Correlation of an accelerometer with temperature, before and after correction (thesis table 4.3)."""

    before: CorrelationFound
    after: CorrelationFound


@dataclass(frozen=True)
class GyroTemperature:
    """Test of a gyro's independence of its temperature, over three runs together (thesis table 4.6)."""

    axis: str
    runs: tuple[CorrelationFound, ...]
    p_value: float
    """Joint p-value of the runs by Fisher's method."""
    slope_rad_s_c: float
    """Weighted slope over the runs."""
    slope_sd_rad_s_c: float
    """Standard uncertainty of that slope."""


@dataclass(frozen=True)
class GyroNoise:
    """Noise of one gyro in one run (thesis table 4.7), with the unit's known noise to compare. None as a coefficient:
    not observed.
    """

    run: str
    axis: str
    quantization: float | None
    random_walk: float | None
    bias_instability: float | None
    uncertainties: tuple[float | None, float | None, float | None]
    upper_limits: tuple[float | None, float | None, float | None]
    """Upper limits of Q, N and B (95 %, one-sided), observed or not; None: unbounded."""
    known: Triple | None


@dataclass(frozen=True)
class AllanFound:
    """Allan deviations of one accelerometer in one run, of means over a second."""

    run: str
    axis: str
    tau_s: tuple[float, ...]
    before: tuple[float, ...]
    after: tuple[float, ...]
    lower: tuple[float, ...]
    """Lower end of the confidence interval of `after`."""
    upper: tuple[float, ...]
    """Upper end of the confidence interval of `after`."""
    rise: float
    """Largest ratio of a lower end to the upper end at any shorter time: above one the deviation surely rises."""


@dataclass(frozen=True)
class Hysteresis:
    """Corrected accelerometer at one temperature, reached from below less reached from above, in one run."""

    run: str
    axis: str
    target_c: float
    difference_m_s2: float
    standard_uncertainty_m_s2: float
    p_value: float
    """Chance of as large a difference by noise: the unit's where it is known, else that of the fit's residuals."""


@dataclass(frozen=True)
class GyroCorrected:
    """Correction of a gyro that depends on temperature."""

    axis: str
    order: int
    reason: str
    p_before: float
    p_after: float | None
    """p-value of "no dependence is left" in each run, corrected by a fit to the others; None with a single run."""


@dataclass(frozen=True)
class ThermalCycle:
    """Complete results of a thermal cycle."""

    judged: str
    """Judged correction: "fit" of this cycle, or "current" of the unit, which has not seen this cycle."""
    reference_c: tuple[float, float]
    stage_one: bool
    """True if the converter's own model was taken out first."""
    force_known: bool
    """True if the forces come from the unit's calibration."""
    regime_delay_s: float
    """Delay of the regime indicator itself."""
    runs: tuple[RunFound, ...]
    axes: tuple[AxisFound, AxisFound, AxisFound]
    """Axis fits of the form that was fitted."""
    correction: ThermalCorrection
    """Thermal correction fitted to this cycle."""
    soaks: tuple[SoakFound, ...]
    """Soak errors under the judged correction."""
    magnitude_m_s2: tuple[tuple[float, float], ...]
    """Rms of |ĝ| about its mean in each run, before and after correction."""
    forms: tuple[FormFound, ...]
    accelerometers: tuple[AccelerometerCorrelation, ...]
    gyros: tuple[GyroTemperature, ...]
    gyro_noise: tuple[GyroNoise, ...]
    allan: tuple[AllanFound, ...]
    warnings: tuple[str, ...]
    following: Following | None = None
    """Delay of the converter's sensor, found from the readings; None where it was not found."""
    converter_lag_s: float | None = None
    """Time constant of the converter's sensor that the fit was given."""
    thermometers: bool = False
    """True if the unit's sensors were corrected by its current calibration of thermometers."""
    hysteresis: tuple[Hysteresis, ...] = ()
    gyro_correction: GyroThermalCorrection | None = None
    """For gyros that depend on temperature; None where none does."""
    gyros_corrected: tuple[GyroCorrected, ...] = ()
