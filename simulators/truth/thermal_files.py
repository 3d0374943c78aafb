"""Thermal part of a unit's truth file: ``[thermal.…]``, all of it optional; absent values are as in `thermal`.

Pairs are a linear and a square term, of the named unit for each °C and for each °C² from the reference temperature.
"""

from collections.abc import Mapping
from dataclasses import replace
from typing import Any, TypeVar, cast

from procedures.core import units
from procedures.core.recording import AXES
from simulators.truth.ranges import TruthError
from simulators.truth.tables import Key, check_keys, keyed_lines, read_changes, record_lines
from simulators.truth.thermal import THERMOMETERS, UnitThermalTruth

T = TypeVar("T")

ACCELEROMETER_KEYS = {
    "scale_static_ppm": Key("scale_static", units.PPM, -1e5, 1e5, "pair"),
    "scale_dynamic_ppm": Key("scale_dynamic", units.PPM, -1e5, 1e5, "pair"),
    "bias_static_m_s2": Key("bias_static", 1.0, -10.0, 10.0, "pair"),
    "bias_dynamic_m_s2": Key("bias_dynamic", 1.0, -10.0, 10.0, "pair"),
    "block_share": Key("block_share", 1.0, 0.0, 1.0, "number"),
}
CONVERTER_KEYS = {
    "codes_a_ma": Key("codes_a_ma", 1.0, 1.0, 1e9, "number"),
    "zero_code": Key("zero_code", 1.0, -1e6, 1e6, "number"),
    "scale_drift_ppm": Key("scale_drift", units.PPM, -1e5, 1e5, "pair"),
    "zero_drift_codes": Key("zero_drift", 1.0, -1e4, 1e4, "pair"),
}
GYRO_KEYS = {"fault_residue_deg_h": Key("fault_residue_rad_s_c", units.DEG_PER_HOUR, -1e4, 1e4)}
"""Residue that a failing perimeter control lets through, for each °C."""


def read_thermal(table: Any) -> UnitThermalTruth:
    """Read the truth of a table ``thermal``. Raises `TruthError`."""
    if not isinstance(table, dict):
        raise TruthError(f"thermal = {table!r} must be a table")
    given, default = cast(Mapping[str, Any], table), UnitThermalTruth()
    known = {"network", "gyro", *_names("accelerometer", AXES), *_names("converter", AXES)}
    check_keys("thermal", given, known | set(_names("thermometer", THERMOMETERS)), set())

    def changed(name: str, of: T, keys: Mapping[str, Key] | None = None) -> T:
        return read_changes(of, f"thermal.{name}", given.get(name, {}), keys)

    def each(kind: str, of: tuple[T, ...], which: tuple[str, ...], keys: Mapping[str, Key] | None) -> tuple[T, ...]:
        return tuple(changed(n, one, keys) for n, one in zip(_names(kind, which), of, strict=True))

    x, y, z = each("accelerometer", default.accelerometers, AXES, ACCELEROMETER_KEYS)
    converter_x, converter_y, converter_z = each("converter", default.converter, AXES, CONVERTER_KEYS)
    return replace(
        default,
        network=changed("network", default.network),
        accelerometers=(x, y, z),
        converter=(converter_x, converter_y, converter_z),
        gyro=changed("gyro", default.gyro, GYRO_KEYS),
        thermometers=each("thermometer", default.thermometers, THERMOMETERS, None),
    )


def thermal_lines(truth: UnitThermalTruth) -> list[str]:
    """Write the thermal truth back to lines of text."""
    lines = record_lines("thermal.network", truth.network)
    for name, one in zip(_names("accelerometer", AXES), truth.accelerometers, strict=True):
        lines += keyed_lines(f"thermal.{name}", one, ACCELEROMETER_KEYS)
    for name, one in zip(_names("converter", AXES), truth.converter, strict=True):
        lines += keyed_lines(f"thermal.{name}", one, CONVERTER_KEYS)
    lines += keyed_lines("thermal.gyro", truth.gyro, GYRO_KEYS)
    for name, one in zip(_names("thermometer", THERMOMETERS), truth.thermometers, strict=True):
        lines += record_lines(f"thermal.{name}", one)
    return lines


def _names(kind: str, which: tuple[str, ...]) -> tuple[str, ...]:
    return tuple(f"{kind}_{one}" for one in which)
