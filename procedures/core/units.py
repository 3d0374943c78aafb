"""The only place where a conversion factor is written. Multiply to reach SI, divide to leave it."""

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
MICRO_G = 1e-6 * STANDARD_GRAVITY
"""One millionth of standard gravity [m/s²]: the µg of data sheets, independent of the site."""

EARTH_RATE = 7.292115e-5
"""Earth's rotation rate [rad/s], WGS 84 (NIMA TR8350.2); 15.041067 deg/h."""

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
