"""The units that a file's columns may be in, and how each becomes the unit of a stored channel.

Samples stay as they were sent; the factor goes into the channel's scale. Must not know files.
"""

from math import inf
from typing import NamedTuple

from procedures.core import units
from procedures.core.recording import UNITS, Channel, Quantity


class _Size(NamedTuple):
    """A unit in terms of the stored one: ``stored = factor·(value − zero)``."""

    factor: float
    zero: float = 0.0


_ANGLE = {
    "rad": 1.0,
    "mrad": 1e-3,
    "deg": units.DEG,
    "arcmin": units.DEG / 60.0,
    "arcsec": units.ARCSEC,
}
_RATE = {
    "rad/s": 1.0,
    "mrad/s": 1e-3,
    "deg/s": units.DEG,
    "mdeg/s": 1e-3 * units.DEG,
    "deg/h": units.DEG_PER_HOUR,
}
_FORCE = {
    "m/s^2": 1.0,
    "mm/s^2": 1e-3,
    "g": units.STANDARD_GRAVITY,
    "mg": 1e-3 * units.STANDARD_GRAVITY,
    "ug": units.MICRO_G,
}
_VELOCITY = {"m/s": 1.0, "mm/s": 1e-3, "g*s": units.STANDARD_GRAVITY}
_TEMPERATURE = {"degC": _Size(1.0), "K": _Size(1.0, 273.15), "degF": _Size(1.0 / 1.8, 32.0)}

_SIZES: dict[Quantity, dict[str, _Size]] = {
    Quantity.ANGLE_INCREMENT: {name: _Size(size) for name, size in _ANGLE.items()},
    Quantity.VELOCITY_INCREMENT: {name: _Size(size) for name, size in _VELOCITY.items()},
    Quantity.ANGULAR_RATE: {name: _Size(size) for name, size in _RATE.items()},
    Quantity.SPECIFIC_FORCE: {name: _Size(size) for name, size in _FORCE.items()},
    Quantity.TEMPERATURE: _TEMPERATURE,
    Quantity.TABLE_ANGLE: {name: _Size(size) for name, size in _ANGLE.items()},
    Quantity.TIME: {"s": _Size(1.0), "ms": _Size(1e-3), "us": _Size(1e-6)},
}
_SPELLINGS = {
    "dps": "deg/s",
    "mdps": "mdeg/s",
    "°/s": "deg/s",
    "°/h": "deg/h",
    "deg/hr": "deg/h",
    "°": "deg",
    "µg": "ug",
    "μg": "ug",
    "m/s2": "m/s^2",
    "m/s²": "m/s^2",
    "°C": "degC",
    "C": "degC",
    "°F": "degF",
    "counts": "count",
    "lsb": "count",
    "LSB": "count",
}
"""Other spellings that people use; the first of µg is the micro sign, the second the Greek letter."""


def spelled(unit: str) -> str:
    """Return a unit in the one spelling that is used here; an unknown one as it is."""
    return _SPELLINGS.get(unit, unit)


def every_unit() -> set[str]:
    """Return all units of all quantities, in every spelling."""
    return {unit for sizes in _SIZES.values() for unit in sizes} | set(_SPELLINGS)


def allowed_units(quantity: Quantity) -> tuple[str, ...]:
    """Return the units that a column of a quantity may have; "count" means that its scale is not known yet."""
    return (*_SIZES[quantity], "count")


def stored_channel(name: str, quantity: Quantity, unit: str, scale: float, offset: float) -> Channel:
    """Return a column's channel, ``scale·(raw − offset)`` in `unit`, converted to the unit that is stored.

    Raises `ValueError` for a unit that the quantity does not have, and for a scale of zero.
    """
    unit = spelled(unit)
    if unit == "count":
        return Channel(name, quantity, unit, scale, offset)
    size = _SIZES[quantity].get(unit)
    if size is None:
        raise ValueError(
            f"channel {name!r}: unit {unit!r} is none of {', '.join(allowed_units(quantity))}, "
            f"which a column of {quantity.value} may have"
        )
    zero = size.zero / scale if scale else inf
    return Channel(name, quantity, UNITS[quantity][0], scale * size.factor, offset + zero if size.zero else offset)
