"""Calibration of a unit's temperature sensors against the chamber: a cold start at each soak.

A unit that is on is warmer than its air. So it soaks switched off, is switched on and read for two minutes; its nodes
leave the air's temperature T0 at a steady rate that bends a little, and a sensor of time constant τ follows them:

``r(t) = T0 + a·(t − τ·(1 − e^{−t/τ})) + c·(t² − 2τ·t + 2τ²·(1 − e^{−t/τ}))``, t from switching on.

T0 less the chamber's air is the sensor's error there; a straight line through the soaks gives offset and slope. Three
uncertainties are told apart: the reading's own (independent), the chamber's at each soak (common to the sensors), and
that of the air at the unit's place (common to all, it enters each offset whole).
"""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from scipy.special import chdtrc

from procedures.analysis.cells import cell_means
from procedures.analysis.thermal.profile_progress import AIR, DISCONNECTED_CODE, SENSORS
from procedures.core.arrays import Array
from procedures.core.errors import BadParameter, UnfitRecording
from procedures.core.recording import Recording
from procedures.core.temperature.thermometers import SensorCorrection, ThermometerCorrection

CELL_S = 1.0
"""Units send their temperatures once a second."""
UPDATE_SD_S = 0.5
"""Standard uncertainty of the age of a reading that is sent again until the next one [s]."""
FEWEST_SOAKS = 3
FEWEST_CELLS = 20


@dataclass(frozen=True)
class SoakSettings:
    """Chamber and unit as far as the comparison needs them. Raises `BadParameter`."""

    place_sd_c: float
    """Standard uncertainty of the air at the unit's place against the chamber's reading, constant over the job."""
    soak_sd_c: float
    """The same, independently at each soak."""
    lag_s: float
    """Time constant of the sensors by their data sheet."""
    lag_sd_s: float
    soak_s: float
    """Time switched off at a temperature before it is read."""
    time_constant_s: float
    """Slowest time constant of the unit's heat."""
    reference_c: float = 20.0

    def __post_init__(self) -> None:
        for name in ("place_sd_c", "soak_sd_c", "lag_s", "lag_sd_s"):
            value = getattr(self, name)
            if not 0.0 <= value < np.inf:
                raise BadParameter(name, value, "finite and not negative")
        for name in ("soak_s", "time_constant_s"):
            value = getattr(self, name)
            if not 0.0 < value < np.inf:
                raise BadParameter(name, value, "finite and above 0")

    def unsoaked_c(self, step_c: Array) -> Array:
        """Return the rest of a step of the chamber's temperature that the unit has not followed, ``|step|·e^{−soak/τ}``
        [°C].
        """
        return np.abs(step_c) * np.exp(-self.soak_s / self.time_constant_s)


@dataclass(frozen=True)
class Soaked:
    """Readings of m sensors at n soaks, brought back to the moment of switching on."""

    channels: tuple[str, ...]
    target_c: Array
    """Target temperatures, (n,), in the order that they were measured."""
    air_c: Array
    """Chamber's own reading, (n,)."""
    reading_c: Array
    """Readings at switching on, (m, n)."""
    reading_sd_c: Array
    """Their own standard uncertainties: noise, lag and the moment of reading, (m, n)."""


def read_soaks(recordings: Sequence[Recording], settings: SoakSettings) -> Soaked:
    """Return the readings of the unit's sensors at cold starts. Raises `UnfitRecording`, `MissingChannel`."""
    targets: list[float] = []
    air: list[float] = []
    found: list[tuple[Array, Array]] = []
    for recording in recordings:
        station = recording.info.station
        if station is None or station.temperature_c is None:
            raise UnfitRecording(f"recording {recording.info.id} is not that of a soak: its station has no temperature")
        cells = cell_means(recording, (*SENSORS, AIR), CELL_S)
        since = recording.info.since_launch_s + np.arange(cells.rates.shape[1]) * cells.cell_s
        for name, row in zip(SENSORS, cells.rates, strict=False):
            _require_working(recording, name, row)
        targets.append(station.temperature_c)
        air.append(float(cells.rates[-1].mean()))
        found.append(_at_start(recording.info.id, since, cells.rates[:-1], settings))
    reading, sd = (np.array(rows).T for rows in zip(*found, strict=True))
    span = float(np.ptp(targets))
    for name, row in zip(SENSORS, reading, strict=True):
        if span > 0.0 and float(np.ptp(row)) < 0.1 * span:
            raise UnfitRecording(
                f"{name} went by {np.ptp(row):.2f} °C while the chamber went by {span:g} °C: it is stuck, or stands "
                "outside the chamber"
            )
    return Soaked(SENSORS, np.array(targets), np.array(air), reading, sd)


def _require_working(recording: Recording, name: str, readings_c: Array) -> None:
    info = recording.info
    lowest = info.channels[info.column(name)].value(float(DISCONNECTED_CODE))
    if float(readings_c.min()) <= 0.99 * lowest < 0.0:
        raise UnfitRecording(f"recording {info.id}: {name} was disconnected")


def _at_start(recording: str, since_s: Array, readings_c: Array, settings: SoakSettings) -> tuple[Array, Array]:
    """Readings (m, n) brought to the moment of switching on, and their standard uncertainties, (m,) each."""
    if len(since_s) < FEWEST_CELLS:
        raise UnfitRecording(f"recording {recording}: {len(since_s)} readings are too few; the least is {FEWEST_CELLS}")
    tau = settings.lag_s
    start, rate, variance = _line(since_s, readings_c, tau)
    other, _, _ = _line(since_s, readings_c, tau + settings.lag_sd_s)
    return start, np.sqrt(variance + (other - start) ** 2 + (UPDATE_SD_S * rate) ** 2)


def _line(since_s: Array, readings_c: Array, tau: float) -> tuple[Array, Array, Array]:
    """T0, rate a and variance of T0 of each row, by least squares; neighbours that go together widen the variance."""
    gone = 1.0 - np.exp(-since_s / tau) if tau > 0.0 else np.ones_like(since_s)
    columns = (np.ones_like(since_s), since_s - tau * gone, since_s**2 - 2.0 * tau * since_s + 2.0 * tau**2 * gone)
    design = np.column_stack(columns)
    inverse = np.linalg.pinv(design)
    solution = inverse @ readings_c.T
    left = readings_c.T - design @ solution
    free = len(since_s) - design.shape[1]
    variance = np.sum(left**2, axis=0) / free
    power = np.maximum(np.sum(left**2, axis=0), 1e-300)
    beside = np.clip(np.sum(left[1:] * left[:-1], axis=0) / power, 0.0, 0.9)
    widened = variance * (1.0 + beside) / (1.0 - beside)
    return solution[0], solution[1], widened * float(inverse[0] @ inverse[0])


@dataclass(frozen=True)
class SensorFit:
    """Line of one sensor through its soaks: offset, slope, errors, test of straightness."""

    channel: str
    offset_c: float
    offset_sd_c: float
    slope: float
    slope_sd: float
    error_c: tuple[float, ...]
    """Reading at switching on less the chamber's air, at each soak."""
    error_sd_c: tuple[float, ...]
    residual_c: tuple[float, ...]
    p_value: float
    """Chance of residuals as large, were all errors as large as claimed (chi-square of n − 2)."""


@dataclass(frozen=True)
class UpAgainstDown:
    """Difference of a sensor's errors at one temperature reached from below and from above."""

    channel: str
    target_c: float
    difference_c: float
    """Error on the way up less that on the way down."""
    standard_uncertainty_c: float
    p_value: float


@dataclass(frozen=True)
class Calibrated:
    """Calibration of all temperature sensors of a unit: lines, correction, hysteresis."""

    sensors: tuple[SensorFit, ...]
    correction: ThermometerCorrection
    hysteresis: tuple[UpAgainstDown, ...]
    unsoaked_c: tuple[float, ...]
    """Greatest rest of the step before each soak that the unit had not followed."""


def calibrate(soaked: Soaked, settings: SoakSettings) -> Calibrated:
    """Offset and slope of each sensor, with the covariance of all. Raises `UnfitRecording` for too few soaks.

    All sensors share the soaks, so least squares with equal weights is all but the best estimate; the covariance is
    ``P·Σ·Pᵀ`` with the whole Σ of the errors, which are not equal.
    """
    count = len(soaked.target_c)
    if len(set(soaked.target_c.tolist())) < FEWEST_SOAKS:
        raise UnfitRecording(f"soaks at {FEWEST_SOAKS} temperatures at least are needed for a line and its test")
    steps = np.diff(np.concatenate([[settings.reference_c], soaked.air_c]))
    rest = settings.unsoaked_c(steps)
    common = np.full((count, count), settings.place_sd_c**2)
    each = np.diag(settings.soak_sd_c**2 + rest**2 / 3.0)
    inverses, lines, fits = [], [], []
    for channel, reading, sd in zip(soaked.channels, soaked.reading_c, soaked.reading_sd_c, strict=True):
        design = np.column_stack([np.ones(count), reading - settings.reference_c])
        inverse = np.linalg.pinv(design)
        error = reading - soaked.air_c
        line = inverse @ error
        left = error - design @ line
        inverses.append(inverse)
        lines.append(line)
        fits.append((channel, error, np.sqrt(np.diag(each) + sd**2), left, sd))
    size = 2 * len(fits)
    covariance = np.zeros((size, size))
    for i, first in enumerate(inverses):
        for j, second in enumerate(inverses):
            between = common + each + (np.diag(fits[i][4] ** 2) if i == j else 0.0)
            covariance[2 * i : 2 * i + 2, 2 * j : 2 * j + 2] = first @ between @ second.T
    sd = np.sqrt(np.diag(covariance))
    sensors = tuple(
        SensorFit(
            channel,
            float(lines[i][0]),
            float(sd[2 * i]),
            float(lines[i][1]),
            float(sd[2 * i + 1]),
            tuple(error.tolist()),
            tuple(error_sd.tolist()),
            tuple(left.tolist()),
            float(chdtrc(count - 2, float(np.sum((left / error_sd) ** 2)))),
        )
        for i, (channel, error, error_sd, left, _) in enumerate(fits)
    )
    correction = ThermometerCorrection(
        tuple(SensorCorrection(s.channel, s.offset_c, s.slope) for s in sensors),
        settings.reference_c,
        tuple(tuple(row) for row in covariance.tolist()),
        (float(soaked.air_c.min()), float(soaked.air_c.max())),
    )
    return Calibrated(sensors, correction, _hysteresis(soaked, sensors), tuple(rest.tolist()))


def both_ways(targets_c: Sequence[float]) -> list[tuple[float, list[int], list[int]]]:
    """Return the targets that a sequence of soaks reaches from below and from above, with the indices of both kinds of
    soaks.
    """
    ways = [np.sign(b - a) for a, b in pairwise(targets_c)]
    found: list[tuple[float, list[int], list[int]]] = []
    for target in sorted(set(targets_c)):
        up, down = ([k + 1 for k, w in enumerate(ways) if w == way and targets_c[k + 1] == target] for way in (1, -1))
        if up and down:
            found.append((target, up, down))
    return found


def _hysteresis(soaked: Soaked, sensors: Sequence[SensorFit]) -> tuple[UpAgainstDown, ...]:
    """Errors on the way up against those on the way down, at every target that was reached both ways."""
    found: list[UpAgainstDown] = []
    for target, up, down in both_ways(soaked.target_c.tolist()):
        for sensor in sensors:
            error, sd = np.array(sensor.error_c), np.array(sensor.error_sd_c)
            gap = float(error[up].mean() - error[down].mean())
            variance = float(np.sum(sd[up] ** 2) / len(up) ** 2 + np.sum(sd[down] ** 2) / len(down) ** 2)
            p_value = float(chdtrc(1, gap**2 / variance)) if variance > 0.0 else float(gap == 0.0)
            found.append(UpAgainstDown(sensor.channel, target, gap, variance**0.5, p_value))
    return tuple(found)
