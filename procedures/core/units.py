"""Conversion factors; scripts of pages repeat those that they show. Multiply by one to reach SI, divide to leave it."""

from math import pi, sqrt

DEG = pi / 180.0
ARCSEC = DEG / 3600.0
DEG_PER_HOUR = DEG / 3600.0
DEG_PER_SQRT_HOUR = DEG / sqrt(3600.0)
DEG_PER_HOUR_PER_SQRT_HOUR = DEG / 3600.0 / sqrt(3600.0)
DEG_PER_HOUR_PER_HOUR = DEG / 3600.0**2
PPM = 1e-6
HOUR = 3600.0
STANDARD_GRAVITY = 9.80665
FOOT = 0.3048
MICRO_G = 1e-6 * STANDARD_GRAVITY
"""One millionth of standard gravity [m/s²]: the µg of data sheets, independent of the site."""

EARTH_RATE = 7.292115e-5
"""Earth's rotation rate [rad/s], WGS 84 (NIMA TR8350.2); 15.041067 deg/h."""

_NOISE_OF_RATE = {
    "quantization": ("arcsec", ARCSEC),
    "random_walk": ("deg/√h", DEG_PER_SQRT_HOUR),
    "bias_instability": ("deg/h", DEG_PER_HOUR),
    "rate_random_walk": ("deg/h/√h", DEG_PER_HOUR_PER_SQRT_HOUR),
    "rate_ramp": ("deg/h/h", DEG_PER_HOUR_PER_HOUR),
}
_NOISE_OF_FORCE = {
    "quantization": ("µg·s", MICRO_G),
    "random_walk": ("µg·√s", MICRO_G),
    "bias_instability": ("µg", MICRO_G),
    "rate_random_walk": ("µg/√s", MICRO_G),
    "rate_ramp": ("µg/s", MICRO_G),
}
_NOISE_OF_COUNTS = {
    "quantization": ("count·s", 1.0),
    "random_walk": ("count·√s", 1.0),
    "bias_instability": ("count", 1.0),
    "rate_random_walk": ("count/√s", 1.0),
    "rate_ramp": ("count/s", 1.0),
}
NOISE_DISPLAY = {"rad/s": _NOISE_OF_RATE, "m/s^2": _NOISE_OF_FORCE, "count": _NOISE_OF_COUNTS}
"""Rate unit of a channel -> noise coefficient -> (the unit people read, its size in SI)."""
DEVIATION_DISPLAY = {"rad/s": ("deg/h", DEG_PER_HOUR), "m/s^2": ("µg", MICRO_G), "count": ("count", 1.0)}
"""Rate unit of a channel -> (the unit people read a deviation of it in, its size in SI)."""

DISPLAY = {
    "rad/s": ("deg/h", DEG_PER_HOUR),
    "rad": ("arcsec", ARCSEC),
    "m/s^2": ("m/s^2", 1.0),
    "m/s": ("m/s", 1.0),
    "1": ("1", 1.0),
    "degC": ("degC", 1.0),
    "count": ("count", 1.0),
}
"""SI unit -> (the unit people read, its size in SI)."""

_SIZES: dict[str, dict[str, float]] = {
    "rad/s": {"rad/s": 1.0, "deg/s": DEG, "deg/h": DEG_PER_HOUR},
    "rad": {"rad": 1.0, "deg": DEG, "arcsec": ARCSEC},
    "m/s^2": {"m/s^2": 1.0, "µg": MICRO_G},
    "1": {"1": 1.0, "ppm": PPM, "%": 0.01},
    "s": {"s": 1.0, "h": HOUR},
    "rad/√s": {"rad/√s": 1.0, "deg/√h": DEG_PER_SQRT_HOUR},
}
"""SI unit -> the units of the same kind and their size in it; a unit without an entry is only of its own kind."""


def converted(value: float, unit: str, wanted: str) -> float:
    """Return a value converted to another unit of the same kind. Raises `ValueError` naming the units that would do."""
    if unit == wanted:
        return value
    for sizes in _SIZES.values():
        if unit in sizes and wanted in sizes:
            return value * sizes[unit] / sizes[wanted]
    raise ValueError(f"it is in {unit}: {', '.join(units_like(unit))} can be requested, {wanted} cannot")


def units_like(unit: str) -> tuple[str, ...]:
    """Return the units in which a value of this unit can be expressed."""
    return next((tuple(sizes) for sizes in _SIZES.values() if unit in sizes), (unit,))
