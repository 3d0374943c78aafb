"""The unit's temperature sensors before the fit: their calibration taken out, and the converter's delay found."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from procedures.analysis.thermal.cycle.runs import CycleSettings
from procedures.analysis.thermal.cycle.series import CycleSeries
from procedures.analysis.thermal.following import Following, follow
from procedures.analysis.thermal.profile_progress import CASE, CONVERTER, SENSORS
from procedures.core.arrays import Array
from procedures.core.errors import DomainError
from procedures.core.temperature.thermometers import ThermometerCorrection
from procedures.core.thermal_correction import AxisCorrection, ThermalCorrection

SURE = 1e-3
"""The law of the converter's delay is not used where its p-value is below this."""
LARGEST_LAG_SD_S = 1.0
"""A time constant of the converter's sensor that is less certain than this is not used [s]."""
CASE_LIKE_SD_S = 1.0
"""Standard uncertainty of a time constant that was taken over from the case's sensor [s]."""


def as_temperatures(series: CycleSeries, thermometers: ThermometerCorrection | None) -> CycleSeries:
    """Return the series with its sensors corrected; those that were not calibrated as they read. `thermometers` None:
    no sensor was calibrated.
    """
    if thermometers is None:
        return series
    columns = [
        thermometers.corrected(name, series.sensors_c[:, i]) if thermometers.has(name) else series.sensors_c[:, i]
        for i, name in enumerate(SENSORS)
    ]
    return replace(series, sensors_c=np.column_stack(columns))


def with_delay(
    series: Sequence[CycleSeries], settings: CycleSettings
) -> tuple[CycleSettings, Following | None, list[str]]:
    """The settings with the time constant of the converter's sensor found where it was not given, and warnings.

    The delay itself is found in either case. A time constant that the readings do not determine is taken over from the
    case's sensor, and the result says so.
    """
    asked = settings.converter_lag_s is None
    try:
        found = follow(
            [s.case_c for s in series],
            [s.converter_c for s in series],
            series[0].sample_s,
            settings.case_lag_s,
            settings.lag_sd_s,
        )
    except DomainError as refusal:
        warnings = [f"the delay of the converter's sensor was not found: {refusal}"]
        return _like_case(settings, warnings) if asked else (settings, None, [])
    doubts: list[str] = []
    if found.p_value < SURE:
        doubts.append(
            "the converter's sensor does not follow the case's by one delay (p-value of what is left over: "
            f"{found.p_value:.2g}): heat reaches the board by another way too"
        )
    if not asked:
        return settings, found, []
    if found.sensor_lag_sd_s > LARGEST_LAG_SD_S:
        doubts.append(f"its sensor's time constant is told to {found.sensor_lag_sd_s:.2g} s only")
    if doubts:
        own, _, warnings = _like_case(settings, doubts)
        return own, found, warnings
    lag = replace(settings, converter_lag_s=found.sensor_lag_s, converter_lag_sd_s=found.sensor_lag_sd_s)
    return lag, found, []


def _like_case(settings: CycleSettings, doubts: list[str]) -> tuple[CycleSettings, None, list[str]]:
    sentence = (
        f"the time constant of the converter's sensor was taken as the case's, {settings.case_lag_s:g} ± "
        f"{CASE_LIKE_SD_S:g} s; give converter_lag_s where a data sheet has it"
    )
    lag = replace(settings, converter_lag_s=settings.case_lag_s, converter_lag_sd_s=CASE_LIKE_SD_S)
    return lag, None, ["; ".join([*doubts, sentence])]


def with_thermometers(correction: ThermalCorrection, thermometers: ThermometerCorrection | None) -> ThermalCorrection:
    """The correction as one of temperatures, its covariance with what offsets and slopes of the sensors leave open.

    A sensor whose temperatures are wrong by ``o + s·Δ`` turns ``c₁·Δ + c₂·Δ²`` into coefficients that are wrong by
    ``s·c₁ + 2·o·c₂`` and ``2·s·c₂``. `thermometers` None: the correction as it is. Used with the same sensors these
    errors cancel; beside another's they count.
    """
    if thermometers is None:
        return correction
    static = ("temperature_gyro_x", "temperature_gyro_y", "temperature_gyro_z")
    own = static if correction.static_sensors == "gyros" else (CASE,) * 3
    x, y, z = (_axis(a, name, thermometers) for a, name in zip(correction.axes, own, strict=True))
    return replace(correction, axes=(x, y, z), thermometers=thermometers)


def _axis(axis: AxisCorrection, static: str, thermometers: ThermometerCorrection) -> AxisCorrection:
    if not axis.covariance or not (thermometers.has(static) and thermometers.has(CONVERTER)):
        return axis
    a1, a2, a3, a4 = axis.alpha
    b1, b2, b3, b4 = axis.beta
    # By offset and slope of the static sensor, then of the converter's; α of thesis 4.1 has the square first.
    jacobian = np.zeros((8, 4))
    jacobian[0], jacobian[1] = [0.0, 2.0 * a1, 0.0, 0.0], [2.0 * a1, a2, 0.0, 0.0]
    jacobian[2], jacobian[3] = [0.0, 0.0, 0.0, 2.0 * a3], [0.0, 0.0, 2.0 * a3, a4]
    jacobian[4], jacobian[5] = [2.0 * b2, b1, 0.0, 0.0], [0.0, 2.0 * b2, 0.0, 0.0]
    jacobian[6], jacobian[7] = [0.0, 0.0, 2.0 * b4, b3], [0.0, 0.0, 0.0, 2.0 * b4]
    at = thermometers_at(thermometers, (static, CONVERTER), (axis.case_reference_c, axis.converter_reference_c))
    covariance = np.array(axis.covariance) + jacobian @ at @ jacobian.T
    return replace(axis, covariance=tuple(tuple(row) for row in covariance.tolist()))


def thermometers_at(
    thermometers: ThermometerCorrection, channels: tuple[str, str], references_c: tuple[float, float]
) -> Array:
    """Return the covariance of offset and slope of two sensors, each about a reference of its own, (4, 4)."""
    turn = np.eye(4)
    for k, reference in enumerate(references_c):
        turn[2 * k, 2 * k + 1] = reference - thermometers.reference_c
    return turn @ thermometers.of_pair(channels) @ turn.T
