"""Result of `thermal_cycle`. Written by `generate_results.py`; do not edit."""

from typing import Literal

from bench_client.results.part import Part, ResultHead
from bench_client.results.shared import Check, Statement, Verdict
from bench_client.results.shared_by_two import AxisCorrection, GyroThermalCorrection, ThermalCorrection


class LegEvidence(Part):
    """Recorded evidence of one leg; times since the recording's beginning [s]."""

    target_c: float
    ramp_c_min: float
    began_s: float
    reached_s: float | None
    soaked_s: float | None
    ended_s: float
    case_c: float
    converter_c: float
    case_slope_c_min: float
    converter_slope_c_min: float
    air_c: float


class LegRegime(Part):
    """Regime switching observed by the indicator in one leg of the profile."""

    ramp_began_s: float | None
    ramp_ended_s: float | None
    dynamic_s: float | None
    static_s: float | None
    onset_delay_s: float | None
    chatter: int


class Trace(Part):
    """Plot data of a run: means over `step_s`, lists of equal length."""

    t_s: tuple[float, ...]
    dynamic: tuple[bool, ...]
    sensors_c: tuple[tuple[float, ...], ...]
    air_c: tuple[float, ...]
    set_point_c: tuple[float, ...]
    acceleration_c_s2: tuple[float, ...]
    before_m_s2: tuple[tuple[float, ...], ...]
    after_m_s2: tuple[tuple[float, ...], ...]
    magnitude_before_m_s2: tuple[float, ...]
    magnitude_after_m_s2: tuple[float, ...]


class RunFound(Part):
    """Observations of one run: its recorded temperatures and the regimes that the indicator found."""

    recording: str
    name: str
    up: int
    duration_s: float
    force_m_s2: tuple[float, ...]
    legs: tuple[LegEvidence, ...]
    regimes: tuple[LegRegime, ...]
    static_share: float
    trace: Trace


class AxisFound(Part):
    """Fit of one accelerometer's correction."""

    correction: AxisCorrection
    uncertainties: tuple[float, ...]
    residual_sd_m_s2: tuple[float | None, ...]
    effective_samples: float
    condition: float
    bic: tuple[float, ...]
    p_values: tuple[float, ...]
    preferred_order: int
    order_reason: str = ""


class SoakFound(Part):
    """Errors of one soak, root mean square over the runs (thesis table 4.5)."""

    leg: int
    target_c: float
    case_c: float
    runs: int
    before_m_s2: tuple[float, ...]
    after_m_s2: tuple[float, ...]
    spread_before_m_s2: tuple[float, ...]
    spread_after_m_s2: tuple[float, ...]


class FormFound(Part):
    """Performance of one correction form on this cycle."""

    form: str
    worst_3_sigma_m_s2: tuple[float, ...]
    magnitude_static_m_s2: float
    magnitude_dynamic_m_s2: float


class CorrelationFound(Part):
    """Correlation of one channel of one run with a temperature."""

    run: str
    axis: str
    r: float
    effective_samples: float
    slope: float
    slope_sd: float
    p_value: float


class AccelerometerCorrelation(Part):
    """Correlation of an accelerometer with temperature, before and after correction (thesis table 4.3)."""

    before: CorrelationFound
    after: CorrelationFound


class GyroTemperature(Part):
    """Test of a gyro's independence of its temperature, over three runs together (thesis table 4.6)."""

    axis: str
    runs: tuple[CorrelationFound, ...]
    p_value: float
    slope_rad_s_c: float
    slope_sd_rad_s_c: float


class GyroNoise(Part):
    """Noise of one gyro in one run (thesis table 4.7), with the unit's known noise to compare. None: not observed."""

    run: str
    axis: str
    quantization: float | None
    random_walk: float | None
    bias_instability: float | None
    uncertainties: tuple[float | None, ...]
    upper_limits: tuple[float, ...]
    known: tuple[float, ...] | None


class AllanFound(Part):
    """Allan deviations of one accelerometer in one run, of means over a second."""

    run: str
    axis: str
    tau_s: tuple[float, ...]
    before: tuple[float, ...]
    after: tuple[float, ...]
    lower: tuple[float, ...]
    upper: tuple[float, ...]
    rise: float


class Following(Part):
    """Law by which the converter's sensor follows the case's."""

    delay_s: float
    delay_sd_s: float
    total_delay_s: float
    total_delay_sd_s: float
    sensor_lag_s: float
    sensor_lag_sd_s: float
    heating_c: tuple[float, ...]
    residual_sd_c: float
    p_value: float


class Hysteresis(Part):
    """Corrected accelerometer at one temperature, reached from below less reached from above, in one run."""

    run: str
    axis: str
    target_c: float
    difference_m_s2: float
    standard_uncertainty_m_s2: float
    p_value: float


class GyroCorrected(Part):
    """Correction of a gyro that depends on temperature."""

    axis: str
    order: int
    reason: str
    p_before: float
    p_after: float | None


class ThermalCycle(Part):
    """Complete results of a thermal cycle."""

    judged: str
    reference_c: tuple[float, ...]
    stage_one: bool
    force_known: bool
    regime_delay_s: float
    runs: tuple[RunFound, ...]
    axes: tuple[AxisFound, ...]
    correction: ThermalCorrection
    soaks: tuple[SoakFound, ...]
    magnitude_m_s2: tuple[tuple[float, ...], ...]
    forms: tuple[FormFound, ...]
    accelerometers: tuple[AccelerometerCorrelation, ...]
    gyros: tuple[GyroTemperature, ...]
    gyro_noise: tuple[GyroNoise, ...]
    allan: tuple[AllanFound, ...]
    warnings: tuple[str, ...]
    following: Following | None = None
    converter_lag_s: float | None = None
    thermometers: bool = False
    hysteresis: tuple[Hysteresis, ...] = ()
    gyro_correction: GyroThermalCorrection | None = None
    gyros_corrected: tuple[GyroCorrected, ...] = ()


class ThermalCycleDocument(Part):
    """Thermal correction, and the performance of it and of the gyros over temperature."""

    checks: tuple[Check, ...] = ()
    verdict: Verdict
    warnings: tuple[str, ...] = ()
    statement: Statement | None = None
    """None without checks and in results of older versions"""
    cycle: ThermalCycle


class ThermalCycleResult(ResultHead):
    """A result: Thermal cycle."""

    kind: Literal["procedure"]
    name: Literal["thermal_cycle"]
    document: ThermalCycleDocument
