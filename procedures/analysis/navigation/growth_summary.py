"""Summary of an error growth for the report: curves, one sentence, and the warnings on its validity."""

from dataclasses import dataclass

import numpy as np

from procedures.analysis.navigation.error_growth import Growth, radius_containing
from procedures.analysis.navigation.error_model import (
    HEADING,
    HEIGHT,
    LATITUDE,
    LONGITUDE,
    TILT_EAST,
    TILT_NORTH,
    V_EAST,
    V_NORTH,
    V_UP,
    Place,
)
from procedures.analysis.navigation.instrument_errors import TriadErrors
from procedures.core.arrays import Array


@dataclass(frozen=True)
class Curve:
    """One error's standard deviation over the times of a growth."""

    name: str
    unit: str
    sd: tuple[float, ...]


def curves(place: Place, growth: Growth) -> tuple[Curve, ...]:
    """Return the standard deviations of position [m], velocity [m/s] and attitude [rad] as curves; height where it is
    free.
    """
    sd = np.sqrt(np.maximum(np.diagonal(growth.total, axis1=1, axis2=2), 0.0))
    east = place.radius_m * float(np.cos(place.latitude_rad))
    told = [
        ("north", "m", LATITUDE, place.radius_m),
        ("east", "m", LONGITUDE, east),
        ("velocity north", "m/s", V_NORTH, 1.0),
        ("velocity east", "m/s", V_EAST, 1.0),
        ("tilt about north", "rad", TILT_NORTH, 1.0),
        ("tilt about east", "rad", TILT_EAST, 1.0),
        ("heading", "rad", HEADING, 1.0),
    ]
    if place.vertical == "free":
        told += [("height", "m", HEIGHT, 1.0), ("velocity up", "m/s", V_UP, 1.0)]
    return tuple(Curve(name, unit, tuple((size * sd[:, state]).tolist())) for name, unit, state, size in told)


def radius_95(place: Place, covariance: Array) -> float:
    """Return the radius [m] of the circle about the true place that holds 95 % of the positions, from the errors'
    covariance (9, 9).
    """
    return radius_containing(0.95, place.metres @ covariance @ place.metres.T)


def greatest(growth: Growth) -> tuple[float, float]:
    """Return the greatest standard deviation of the tilts and of the heading over the whole time [rad]."""
    sd = np.sqrt(np.maximum(np.diagonal(growth.total, axis1=1, axis2=2), 0.0)).max(axis=0)
    return float(max(sd[TILT_NORTH], sd[TILT_EAST])), float(sd[HEADING])


def sentence(radius_m: float, own_m: float | None, uncalibrated_m: float | None, linear: bool) -> str:
    """Return one sentence on the position's radius of 95 % after an hour, and on what the calibration contributes to
    it.

    `own_m`: the radius that the calibration's own uncertainty would leave, None without a calibration.
    `uncalibrated_m`: that of nominal outputs; None: they could not navigate (`linear`), or it is not known.
    """
    said = f"After one hour parked, the position is within {radius_m:.3g} m of the truth with 95 %"
    if own_m is None:
        return said + "."
    said += f"; the calibration's own uncertainty alone would leave {own_m:.3g} m"
    if uncalibrated_m is not None:
        return said + f", nominal outputs without it {uncalibrated_m:.3g} m."
    return said + (", nominal outputs without it could not navigate at all." if linear else ".")


def warnings(gyro: TriadErrors, accelerometer: TriadErrors, has_launch: bool) -> tuple[str, ...]:
    """Return warnings on contributions that are missing from the figures. `has_launch`: the launch-to-launch stability
    of the unit is known.
    """
    found = [
        f"the noise of the {name} triad is not known and counts as none"
        for name, errors in (("gyro", gyro), ("accelerometer", accelerometer))
        if not errors.noise
    ]
    if not has_launch:
        found.append("the change from launch to launch is not known: the figures hold for the calibration's own launch")
    return tuple(found)
