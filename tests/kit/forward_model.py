"""A unit with the thesis's noise and a table with flaws: a forward model that shares no line with the analysis.

Only the covariance of drawn noise, `station_noise`, is the analysis's own.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field

import numpy as np

from procedures.analysis.calibration.station_noise import triad_covariance
from procedures.core import units
from procedures.core.noise import NoiseCoefficients
from procedures.core.recording import (
    ACCELEROMETER,
    GYRO,
    Channel,
    MemoryRecording,
    Quantity,
    RecordingInfo,
    Station,
)
from procedures.core.site import Site
from procedures.core.unit import Unit

GYRO_NOISE = NoiseCoefficients(
    quantization=0.39 * units.ARCSEC,
    random_walk=0.0014 * units.DEG_PER_SQRT_HOUR,
    bias_instability=0.0016 * units.DEG_PER_HOUR,
)
ACCELEROMETER_NOISE = NoiseCoefficients(quantization=11 * units.MICRO_G, bias_instability=0.75 * units.MICRO_G)
SITE = Site(latitude_deg=50.45, gravity_m_s2=9.810553, azimuth_deg=37.0, azimuth_sd_arcsec=10.0)

K_GYRO = np.array(
    [[1.0048, -0.00033819, 0.00022548], [-0.0045217, 1.0017, -0.0091769], [0.0025188, -0.0031615, 1.0009]]
)
B_GYRO = np.array([0.1856, 0.026498, -0.027218]) * units.DEG_PER_HOUR
K_ACCELEROMETER = np.array(
    [[0.8148, -0.0010369, 0.0010814], [0.0010164, 0.85883, 0.0053613], [-0.0014483, -0.005538, 0.85306]]
)
B_ACCELEROMETER = np.array([0.090117, 0.092241, 0.12179])

BETA_GAMMA = [(0, -90), (0, 90), (90, 0), (-90, 0), (0, 0), (180, 0)]
BETA_GAMMA += [(-90, -45), (90, 45), (180, -45), (0, 45), (135, 0), (-45, 0)]
"""(β, γ) [deg] of the thesis's twelve orientations (figure 5.4), written out here again."""
CHANNELS = (
    *(Channel(name, Quantity.ANGULAR_RATE, "rad/s") for name in GYRO),
    *(Channel(name, Quantity.SPECIFIC_FORCE, "m/s^2") for name in ACCELEROMETER),
)
"""Channels of recordings in rates: a count is one rad/s or one m/s²."""


def turn(axis: str, degrees: float) -> np.ndarray:
    """Right-handed rotation matrix written out by hand."""
    c, s = np.cos(np.radians(degrees)), np.sin(np.radians(degrees))
    return {
        "x": np.array([[1, 0, 0], [0, c, -s], [0, s, c]]),
        "y": np.array([[c, 0, s], [0, 1, 0], [-s, 0, c]]),
        "z": np.array([[c, -s, 0], [s, c, 0], [0, 0, 1]]),
    }[axis]


@dataclass
class Table:
    """A table with flaws [deg], built from rotation matrices one after the other."""

    orthogonality: tuple[float, float] = (0.0, 0.0)
    level: tuple[float, float] = (0.0, 0.0)
    azimuth: float = 0.0
    pointing: Callable[[], np.ndarray] = field(default=lambda: np.zeros(3))

    def vectors(self, station: Station, site: Site) -> tuple[np.ndarray, np.ndarray]:
        """Earth's rate and specific force in the unit's axes."""
        a, p = station.angles, self.pointing()
        assert a is not None
        attitude = (
            turn("z", self.level[1])
            @ turn("x", self.level[0])
            @ turn("y", a.outer_deg + p[0])
            @ turn("x", self.orthogonality[0])
            @ turn("z", a.middle_deg + p[1])
            @ turn("y", self.orthogonality[1])
            @ turn("x", a.inner_deg + p[2])
        )
        latitude, azimuth = np.radians(site.latitude_deg), np.radians(site.azimuth_deg + self.azimuth)
        north, up = site.earth_rate_rad_s * np.array([np.cos(latitude), np.sin(latitude)])
        # x looks along the azimuth, clockwise from north; z to its right: north is cos along x, −sin along z.
        rate = np.array([north * np.cos(azimuth), up, -north * np.sin(azimuth)])
        return attitude.T @ rate, attitude.T @ np.array([0.0, site.gravity_m_s2, 0.0])


def random_table(
    rng: np.random.Generator, orthogonality: float, pointing: float, level: float, azimuth: float
) -> Table:
    """A table drawn from standard deviations [arcsec]."""
    deg = 1.0 / 3600.0
    o, t = rng.normal(size=2) * orthogonality * deg, rng.normal(size=2) * level * deg
    heading = float(rng.normal() * azimuth * deg)
    return Table((o[0], o[1]), (t[0], t[1]), heading, lambda: rng.normal(size=3) * pointing * deg)


def station_recordings(
    stations: Sequence[Station],
    channels: tuple[Channel, ...],
    rng: np.random.Generator | None = None,
    table: Table | None = None,
    noise: tuple[np.ndarray, np.ndarray] | None = None,
) -> list[MemoryRecording]:
    """One recording a station at 1 Hz: the outputs U = b + K·v and, with `noise`, station means drawn from (3, n, n).

    A little alternating ripple of zero mean keeps every channel alive.
    """
    table, start, recordings = table or Table(), 10.0, []
    n = len(stations)
    drawn = np.zeros((n, 6))
    if rng is not None and noise is not None:
        for t, covariance in enumerate(noise):
            for c in range(3):
                drawn[:, 3 * t + c] = np.linalg.cholesky(covariance[c]) @ rng.normal(size=n)
    for i, station in enumerate(stations):
        rate, force = table.vectors(station, SITE)
        mean = np.concatenate([B_GYRO + K_GYRO @ rate, B_ACCELEROMETER + K_ACCELEROMETER @ force]) + drawn[i]
        count = 2 * round(station.record_s / 2)
        ripple = np.where(np.arange(count) % 2, 1.0, -1.0)[:, None] * np.array([1e-8] * 3 + [1e-6] * 3)
        info = RecordingInfo(f"r{i}", "S-1", channels, 1.0, count, start, station)
        recordings.append(MemoryRecording(info, mean + ripple))
        start += count + 5.0
    return recordings


def station_noise(stations: Sequence[Station], unit: Unit) -> tuple[np.ndarray, np.ndarray]:
    """Covariances (3, n, n) of gyro and accelerometer means at the times that `station_recordings` gives them."""
    starts = 10.0 + np.cumsum([0.0] + [2 * round(s.record_s / 2) + 5.0 for s in stations[:-1]])
    windows = np.column_stack([starts, starts + [2 * round(s.record_s / 2) for s in stations]])
    gyro, accelerometer = (triad_covariance(unit.triad(triad), windows) for triad in ("gyro", "accelerometer"))
    assert gyro is not None
    assert accelerometer is not None
    return gyro, accelerometer
