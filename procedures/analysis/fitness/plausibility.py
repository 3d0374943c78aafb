"""Plausibility of unit and rate: readings of a unit at rest against gravity and the Earth's rate."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from procedures.analysis.fitness.findings import FitnessSettings
from procedures.analysis.fitness.pieces import Samples
from procedures.core import units
from procedures.core.arrays import Array
from procedures.core.recording import ACCELEROMETER, GYRO, INCREMENTS, TRIADS, Channel, NominalScale, Quantity

BURST = 128
"""Samples that are averaged before a magnitude is taken, so that noise does not pass for a reading."""
BURSTS = 8
"""Number of bursts at the beginning of a piece."""
TOLERANCE = 0.3
"""Relative tolerance of gravity's magnitude: nominal scales are known to some per cent, but the thesis's own unit (its
table 5.1) gives 0.81 … 0.86 of its input; the nearest wrong unit, feet, is a factor of 3.3 away."""
MOST = 1.0 + TOLERANCE
COLDEST_C, HOTTEST_C = -100.0, 200.0
FACTORS = (2.0, 4.0, 5.0)
"""Simple factors of a wrong rate, of a wrong number of summed samples, or of a range set otherwise than declared."""
FACTOR_TOLERANCE = 0.12
"""Relative: nominal scales are known to some per cent, and the nearest two factors are 25 % apart."""
DOUBTFUL_RATE_RAD_S = 0.1
"""A gyro that reads more at rest, 5.7 °/s or 1370 times the Earth's rate, is doubted."""
DOUBTFUL_WALK = 10.0 * units.DEG_PER_SQRT_HOUR
"""A gyro's random walk from its sample noise that is doubted: poor MEMS have 3 deg/√h, and degrees that were taken for
radians make 17 deg/√h and more of ordinary ones."""
SLOWEST_HZ, FASTEST_HZ = 0.5, 40_000.0
"""Rates of inertial units; the fastest MEMS send 32 000 samples a second."""
GYRO_QUANTITIES = (Quantity.ANGLE_INCREMENT, Quantity.ANGULAR_RATE)
FORCE_QUANTITIES = (Quantity.VELOCITY_INCREMENT, Quantity.SPECIFIC_FORCE)
_FORCES = {
    "g": 1.0 / units.STANDARD_GRAVITY,
    "mg": 1e3 / units.STANDARD_GRAVITY,
    "µg": 1e6 / units.STANDARD_GRAVITY,
    "cm/s² (Gal)": 100.0,
    "mm/s², or mg declared as g": 1000.0,
    "a value divided by 1000": 1e-3,
    "a value in m/s² multiplied by 9.81 once more": units.STANDARD_GRAVITY,
    "a value multiplied by 57.3, degrees a radian": 1.0 / units.DEG,
    "a value divided by 57.3, degrees a radian": units.DEG,
}
"""Readings of gravity [m/s²] in another unit, in parts of gravity."""


@dataclass(frozen=True)
class Doubt:
    """A sentence about channels; `certain`: the figures are wrong by a known factor. `of_rate`: the rate is wrong."""

    sentence: str
    certain: bool
    of_rate: bool = False


class Readings:
    """Gathers, piece by piece, the magnitude that each triad reads and the mean of each channel; `doubts` compares them
    with gravity, the Earth's rate and possible temperatures.

    Each piece gives the median of short bursts at its beginning, and the pieces are averaged.
    """

    def __init__(self, channels: Sequence[Channel], rate_hz: float) -> None:
        self._rate_hz = rate_hz
        self._scale = NominalScale.of(channels, rate_hz)
        self._channels = tuple(channels)
        self._names = [c.name for c in channels]
        self._sums = np.zeros(len(channels))
        triads = {name: self._rows(TRIADS[name]) for name in TRIADS}
        self._triads = {name: rows for name, rows in triads.items() if rows}
        self._magnitudes = dict.fromkeys(self._triads, 0.0)
        self._pieces = 0

    def add(self, x: Samples) -> None:
        """Take in new samples of all channels, (channels, n)."""
        if not x.shape[1]:
            return
        length = min(BURST, x.shape[1])
        bursts = min(BURSTS, x.shape[1] // length)
        means = x[:, : length * bursts].astype(np.float64).reshape(len(x), bursts, length).mean(axis=2)
        self._scale.convert_rows(means)
        self._sums += np.sort(means, axis=1)[:, bursts // 2]
        for name, rows in self._triads.items():
            self._magnitudes[name] += float(np.sort(np.linalg.norm(means[rows], axis=0))[bursts // 2])
        self._pieces += 1

    def doubts(self, settings: FitnessSettings, mean: Array, noise: Array) -> dict[str, Doubt]:
        """Return doubts by channel name; `mean` and `noise`, the standard deviation of white noise, of each channel,
        raw.
        """
        if not self._pieces or not settings.at_rest:
            return self._temperatures() if self._pieces else {}
        return {**self._temperatures(), **self._gyros(settings, mean, noise), **self._accelerometers(settings)}

    def _temperatures(self) -> dict[str, Doubt]:
        found: dict[str, Doubt] = {}
        for channel, total in zip(self._channels, self._sums, strict=True):
            mean = float(total) / self._pieces
            if channel.unit == "degC" and not COLDEST_C <= mean <= HOTTEST_C:
                kelvin = ": it looks like kelvins" if HOTTEST_C < mean < 500.0 else ""
                told = f"{COLDEST_C:g} … {HOTTEST_C:g} °C were expected{kelvin}"
                found[channel.name] = Doubt(f"channel {channel.name} reads {mean:.4g} °C where {told}", True)
        return found

    def _accelerometers(self, settings: FitnessSettings) -> dict[str, Doubt]:
        rows = self._triads.get("accelerometer")
        if not settings.reads_gravity:
            return {}
        if rows is None:
            return self._single_accelerometers(settings)
        gravity = settings.gravity_m_s2 or units.STANDARD_GRAVITY
        read = self._magnitudes["accelerometer"] / self._pieces
        if abs(read / gravity - 1.0) <= TOLERANCE:
            return {}
        factor = _factor(read / gravity)
        if factor is not None:
            return self._by_factor(rows, read, gravity, factor)
        return self._told(rows, ACCELEROMETER, read, f"gravity, {gravity:.5g} m/s² ± 30 %", gravity, _FORCES)

    def _single_accelerometers(self, settings: FitnessSettings) -> dict[str, Doubt]:
        """Accelerometers without a whole triad: none of them reads more than gravity, whichever way it points."""
        gravity = settings.gravity_m_s2 or units.STANDARD_GRAVITY
        expected = f"at most gravity, {gravity:.5g} m/s² + 30 %,"
        found: dict[str, Doubt] = {}
        for i, (channel, total) in enumerate(zip(self._channels, self._sums, strict=True)):
            read = abs(float(total)) / self._pieces
            if channel.quantity in FORCE_QUANTITIES and channel.rate_unit == "m/s^2" and read > MOST * gravity:
                larger = {name: size for name, size in _FORCES.items() if size > 1.0}
                found.update(self._told((i,), (channel.name,), read, expected, gravity, larger))
        return found

    def _by_factor(self, rows: Sequence[int], read: float, gravity: float, factor: float) -> dict[str, Doubt]:
        """Accelerometers that read a simple multiple of gravity: the rate of increments, or the range of samples."""
        names, rate = [self._names[r] for r in rows], self._rate_hz
        begin = (
            f"channels {names[0]} … {names[-1]} together read {read:.4g} m/s^2 where gravity, {gravity:.5g} m/s² "
            f"± 30 % was expected, {factor:g} times it"
        )
        if any(self._channels[r].quantity not in INCREMENTS for r in rows):
            told = f"{begin}: the scale or the range that was declared seems to be off by this factor"
            return dict.fromkeys(names, Doubt(told, False))
        names = [c.name for c in self._channels if c.quantity in INCREMENTS and c.unit != "count"]
        told = (
            f"{begin}, as if the rate were {rate / factor:.6g} Hz: the declared rate, {rate:g} Hz, or the number of "
            f"samples summed, is wrong; this falsifies all increments ({', '.join(names)})"
        )
        return dict.fromkeys(names, Doubt(told, True, of_rate=True))

    def _gyros(self, settings: FitnessSettings, mean: Array, noise: Array) -> dict[str, Doubt]:
        limit = settings.gyro_rest_rad_s
        rows = self._triads.get("gyro")
        if rows is not None:
            read = {tuple(rows): self._magnitudes["gyro"] / self._pieces}
        else:
            read = {
                (i,): abs(float(self._sums[i])) / self._pieces
                for i, c in enumerate(self._channels)
                if c.quantity in GYRO_QUANTITIES and c.rate_unit == "rad/s"
            }
        # A good gyro reads the Earth's rate or little more; any other reading shows that the unit is wrong, not which.
        good = limit < 10.0 * units.EARTH_RATE
        candidates = {"deg/s": 1.0 / units.DEG, "deg/h": 1.0 / units.DEG_PER_HOUR} if good else {}
        expected = f"less than {limit:.3g} rad/s at rest"
        found: dict[str, Doubt] = {}
        for group, burst in read.items():
            # Single bursts distinguish motion from rest; the reading at rest is more certain from all samples.
            value = min(burst, float(np.linalg.norm(self._scale.rates(mean)[list(group)])))
            names = [self._names[i] for i in group]
            walk = float(np.max((noise * np.abs(self._scale.gain))[list(group)])) / self._rate_hz**0.5
            sampled = all(self._channels[i].quantity is Quantity.ANGULAR_RATE for i in group)
            if value > limit and (good or value * units.DEG > limit or not sampled):
                found.update(self._told(group, names, value, expected, units.EARTH_RATE, candidates))
            elif value > DOUBTFUL_RATE_RAD_S or (sampled and walk > DOUBTFUL_WALK):
                found.update(dict.fromkeys(names, _degrees(names, value, expected, walk if sampled else None)))
        return found

    def _told(
        self,
        rows: Sequence[int],
        names: Sequence[str],
        read: float,
        expected: str,
        truth: float,
        candidates: dict[str, float],
    ) -> dict[str, Doubt]:
        """The sentence on channels that read `read` where `truth` is expected in the declared unit."""
        unit = self._channels[rows[0]].rate_unit
        looks = [name for name, size in candidates.items() if abs(read / (truth * size) - 1.0) <= TOLERANCE]
        if abs(read / (truth * self._rate_hz) - 1.0) <= TOLERANCE:
            looks.append(f"a rate, not increments of 1/{self._rate_hz:g} s")
        if abs(read * self._rate_hz / truth - 1.0) <= TOLERANCE:
            looks.append(f"increments of 1/{self._rate_hz:g} s, not a rate")
        guess = f": it looks like {' or '.join(looks)}" if looks else ""
        shown = f"{names[0]} … {names[-1]} together read" if len(rows) > 1 else f"{names[0]} reads"
        sentence = (
            f"channel{'s' if len(rows) > 1 else ''} {shown} {read:.4g} {unit} where {expected} was expected{guess}"
        )
        return {self._names[row]: Doubt(sentence, bool(looks)) for row in rows}

    def _rows(self, triad: Sequence[str]) -> list[int]:
        """Rows of a triad if it is complete and in SI; otherwise none."""
        wanted = "rad/s" if triad == GYRO else "m/s^2"
        rows = [self._names.index(name) for name in triad if name in self._names]
        return rows if len(rows) == 3 and all(self._channels[r].rate_unit == wanted for r in rows) else []


def unlikely_rate(rate_hz: float) -> str | None:
    """Return a sentence on a sampling rate that no inertial unit has, else None."""
    if SLOWEST_HZ <= rate_hz <= FASTEST_HZ:
        return None
    return (
        f"the declared rate, {rate_hz:g} Hz, is unlikely: inertial units send between {SLOWEST_HZ:g} and "
        f"{FASTEST_HZ:g} samples a second; every time and every rate of this result rests on it"
    )


def _factor(ratio: float) -> float | None:
    """The simple factor, or its inverse, nearest to a ratio; None where none is near."""
    near = [f for g in FACTORS for f in (g, 1.0 / g) if abs(ratio / f - 1.0) <= FACTOR_TOLERANCE]
    return min(near, key=lambda f: abs(ratio / f - 1.0), default=None)


def _degrees(names: Sequence[str], value: float, expected: str, walk: float | None) -> Doubt:
    """Doubt about gyros whose reading at rest or whose noise suggests a value in degrees."""
    shown = f"channels {names[0]} … {names[-1]} together read" if len(names) > 1 else f"channel {names[0]} reads"
    noise = "" if walk is None else f", with a random walk of about {walk / units.DEG_PER_SQRT_HOUR:.3g} deg/√h"
    return Doubt(
        f"{shown} {value:.4g} rad/s where {expected} was expected, {value / units.DEG_PER_HOUR:.4g} deg/h or "
        f"{value / units.EARTH_RATE:.3g} times the Earth's rate{noise}: values in deg/s declared as "
        "rad/s look like this",
        False,
    )
