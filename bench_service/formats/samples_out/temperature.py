"""Temperature corrections of samples on their way out: to the reference temperatures, by the unit's own sensors.

The formulas are those by which a calibration uses the corrections. Here each sample is corrected by the sensors'
readings of the same moment, and the sensors' lag is not taken out: where a sensor is τ late, the temperature that a
sample is corrected for is τ·dT/dt behind.
"""

from collections.abc import Callable, Sequence

import numpy as np

from bench_service.formats.export import Extract
from procedures.core.arrays import Array
from procedures.core.converter import at_reference
from procedures.core.errors import BadParameter
from procedures.core.recording import ACCELEROMETER, AXES, GYRO
from procedures.core.temperature.thermometers import ThermometerCorrection
from procedures.core.unit_correction import UnitCorrection

CASE, CONVERTER = "temperature_case", "temperature_converter"
GYRO_SENSORS = tuple(f"temperature_gyro_{axis}" for axis in AXES)
SENSORS_AS_READ = "as read at each sample, their lag not taken out"

Stage = Callable[[Array, Array], None]
"""Changes values (n, channels) in place, by the values as they were recorded (n, channels), both in nominal units."""


def stages(part: Extract, corrections: Sequence[UnitCorrection]) -> list[Stage]:
    """Return the corrections as steps for blocks of samples. Raises `BadParameter` where channels that they need are
    not among those of the part, or two correct the same.
    """
    kinds = [one.kind for one in corrections]
    if len(set(kinds)) != len(kinds):
        raise BadParameter("corrected_by", ", ".join(kinds), "at most one correction set of each kind")
    if {"thermal", "converter"} <= set(kinds):
        allowed = "one of the kinds thermal and converter: both take the converter's drift out of the accelerometers"
        raise BadParameter("corrected_by", ", ".join(kinds), allowed)
    return [_stage(part, one) for one in corrections]


def corrected_channels(one: UnitCorrection) -> tuple[str, ...]:
    """Return the channels whose values a correction changes."""
    if one.thermometers is not None:
        return tuple(sensor.channel for sensor in one.thermometers.sensors)
    return GYRO if one.gyros is not None else ACCELEROMETER


def fitted_range(one: UnitCorrection) -> str:
    """Return the temperatures between which a correction was fitted, in words; beyond them it extrapolates."""
    if one.thermal is not None:
        known = one.thermal.fitted_range
        pairs = {} if known is None else {"case ": known.case_c, "converter ": known.converter_c}
    elif (other := one.gyros or one.thermometers) is not None:
        pairs = {"": other.fitted_range_c}
    else:
        pairs = {}
    return ", ".join(f"{name}{low:.1f} to {high:.1f} degC" for name, (low, high) in pairs.items()) or "not known"


def _stage(part: Extract, one: UnitCorrection) -> Stage:
    if one.thermometers is not None:
        return _thermometers(part, one.thermometers)
    if (gyros := one.gyros) is not None:
        own, by = _columns(part, one, GYRO, "rad/s"), _columns(part, one, GYRO_SENSORS, "degC")

        def turned(values: Array, read: Array) -> None:
            readings = _temperatures(read[:, by], GYRO_SENSORS, gyros.thermometers)
            values[:, own] = gyros.apply(values[:, own], readings)

        return turned
    own, converter = _columns(part, one, ACCELEROMETER, "m/s^2"), _columns(part, one, (CONVERTER,), "degC")
    if (models := one.converter) is not None:

        def staged(values: Array, read: Array) -> None:
            values[:, own] = at_reference(values[:, own], read[:, converter[0]], models)

        return staged
    thermal = one.thermal
    assert thermal is not None
    names = GYRO_SENSORS if thermal.static_sensors == "gyros" else (CASE,)
    static = _columns(part, one, names, "degC")

    def brought(values: Array, read: Array) -> None:
        case = _temperatures(read[:, static], names, thermal.thermometers)
        board = _temperatures(read[:, converter], (CONVERTER,), thermal.thermometers)[:, 0]
        values[:, own] = thermal.at_reference(values[:, own], case if len(names) > 1 else case[:, 0], board)

    return brought


def _thermometers(part: Extract, correction: ThermometerCorrection) -> Stage:
    """Sensors that are exported and were calibrated; the others stay as they are."""
    names = [c.name for c in part.info.channels if c.unit == "degC" and correction.has(c.name)]
    if not names:
        known = ", ".join(sensor.channel for sensor in correction.sensors)
        raise BadParameter("corrected_by", "thermometers", f"samples with one of its sensors' channels: {known}")
    places = [part.info.column(name) for name in names]

    def corrected(values: Array, read: Array) -> None:
        for place, name in zip(places, names, strict=True):
            values[:, place] = correction.corrected(name, read[:, place])

    return corrected


def _temperatures(read: Array, names: Sequence[str], known: ThermometerCorrection | None) -> Array:
    """Temperatures (n, m) [°C] of readings, by the sensors' correction that the fit had taken out of them."""
    if known is None:
        return read
    columns = zip(names, read.T, strict=True)
    return np.column_stack([known.corrected(name, c) if known.has(name) else c for name, c in columns])


def _columns(part: Extract, one: UnitCorrection, names: Sequence[str], unit: str) -> list[int]:
    """Columns of channels. Raises `BadParameter` where one is absent or in another unit."""
    have = {c.name: c.rate_unit for c in part.info.channels}
    missing = [name for name in names if name not in have]
    if missing:
        allowed = f"samples that have the channels of a correction of the kind {one.kind}: no {', '.join(missing)} here"
        raise BadParameter("corrected_by", one.kind, allowed)
    if wrong := {have[name] for name in names} - {unit}:
        raise BadParameter("corrected_by", one.kind, f"channels in {unit}, not in {', '.join(sorted(wrong))}")
    return [part.info.column(name) for name in names]
