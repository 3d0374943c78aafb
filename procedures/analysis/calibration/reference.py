"""Reference vectors of a calibration, the inputs of both triads at each station, and their magnitude."""

from collections.abc import Sequence
from dataclasses import replace

from procedures.core.arrays import Array
from procedures.core.frames import earth_rate_b, specific_force_b
from procedures.core.site import Site
from procedures.core.table_angles import TableAngles

TRIAD_NAMES = ("gyro", "accelerometer")
INPUT_UNITS = {"gyro": "rad/s", "accelerometer": "m/s^2"}


def reference_vectors(triad: str, angles: Sequence[TableAngles], site: Site) -> Array:
    """Return the Earth's rate or specific force in the unit's axes at each station, shape (n, 3), SI."""
    return earth_rate_b(list(angles), site) if triad == "gyro" else specific_force_b(list(angles), site)


def reference_magnitude(triad: str, site: Site) -> float:
    """Return the magnitude of the triad's input: Earth's rate [rad/s] or gravity [m/s²]."""
    return site.earth_rate_rad_s if triad == "gyro" else site.gravity_m_s2


def site_with(
    site: Site,
    latitude_deg: float | None,
    gravity_m_s2: float | None,
    azimuth_deg: float | None,
    azimuth_sd_arcsec: float | None,
) -> Site:
    """Return the bench's site with the values that the parameters override; None keeps the bench's value."""
    given = {
        "latitude_deg": latitude_deg,
        "gravity_m_s2": gravity_m_s2,
        "azimuth_deg": azimuth_deg,
        "azimuth_sd_arcsec": azimuth_sd_arcsec,
    }
    return replace(site, **{name: value for name, value in given.items() if value is not None})
