"""Outputs of gyros on a turning table, by matrices multiplied out: nothing is shared with the product."""

from dataclasses import dataclass

import numpy as np

from procedures.core import units
from procedures.core.recording import Station
from tests.kit.forward_model import B_GYRO, K_GYRO, SITE, turn

REFERENCE = 50.0 * units.DEG


@dataclass(frozen=True)
class Flaws:
    """Right angles [arcsec], and pointing at the start (outer, middle, inner) and of the outer axis at the stop.

    Tilts of the outer axis about the reference frame's x and z, and the heading of the table's zero.
    """

    orthogonality: tuple[float, float] = (0.0, 0.0)
    start: tuple[float, float, float] = (0.0, 0.0, 0.0)
    stop: float = 0.0
    level: tuple[float, float] = (0.0, 0.0)
    azimuth: float = 0.0


def outputs(station: Station, flaws: Flaws, even: np.ndarray, cubic: np.ndarray) -> np.ndarray:
    """Integrated outputs of the three gyros: the table's motion step by step, matrices multiplied out, Simpson."""
    whole, angles = station.turn, station.angles
    assert whole is not None
    assert angles is not None
    up = np.linspace(0.0, 1.0, 2001)
    ramp = up**2 * (3.0 - 2.0 * up)
    steady_s = abs(360.0 * whole.turns) / whole.rate_deg_s - whole.ramp_s
    rest_s = station.record_s - steady_s - 2 * whole.ramp_s
    error_deg = (flaws.stop - flaws.start[0]) / 3600.0
    rate = (360.0 * whole.turns + error_deg) / (steady_s + whole.ramp_s) * units.DEG
    total, angle = np.zeros(3), units.DEG * (angles.outer_deg + flaws.start[0] / 3600.0)
    deg = 1.0 / 3600.0
    inside = (
        turn("x", flaws.orthogonality[0] * deg)
        @ turn("z", angles.middle_deg + flaws.start[1] * deg)
        @ turn("y", flaws.orthogonality[1] * deg)
        @ turn("x", angles.inner_deg + flaws.start[2] * deg)
    )
    latitude, azimuth = np.radians(SITE.latitude_deg), np.radians(SITE.azimuth_deg + flaws.azimuth / 3600.0)
    north, above = SITE.earth_rate_rad_s * np.array([np.cos(latitude), np.sin(latitude)])
    earth = np.array([north * np.cos(azimuth), above, -north * np.sin(azimuth)])
    earth = (turn("z", flaws.level[1] * deg) @ turn("x", flaws.level[0] * deg)).T @ earth
    on_ramp, steady, rest = (whole.ramp_s, ramp), (steady_s, 1.0 + 0 * up), (rest_s, 0 * up)
    for seconds, share in (on_ramp, steady, (whole.ramp_s, ramp[::-1]), rest):
        spin = rate * share
        step = seconds / 2000
        mean = np.concatenate([[0.0], np.cumsum(0.5 * (spin[1:] + spin[:-1]) * step)])
        if np.ptp(share) > 0.0:  # the integral of the ramp, better than by trapezoid
            forth = rate * seconds * (up**3 - up**4 / 2)
            mean = forth if share[0] < share[-1] else rate * seconds / 2 - forth[::-1]
        theta = angle + mean
        level = np.column_stack([
            earth[0] * np.cos(theta) - earth[2] * np.sin(theta),
            earth[1] + spin,
            earth[0] * np.sin(theta) + earth[2] * np.cos(theta),
        ])  # fmt: skip
        a = level @ inside @ K_GYRO.T
        u = B_GYRO + a + 0.5 * even[:, 0] * np.abs(a) + even[:, 1] * a**2 / REFERENCE + cubic * a**3 / REFERENCE**2
        weights = np.full(2001, 2.0)
        weights[1::2], weights[[0, -1]] = 4.0, 1.0
        total += step / 3.0 * (weights @ u)
        angle = theta[-1]
    return total
