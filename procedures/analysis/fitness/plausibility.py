"""Wrong unit: what a unit at rest reads against gravity and against the rate of a turning Earth."""

from collections.abc import Sequence

import numpy as np

from procedures.analysis.fitness.findings import FitnessSettings
from procedures.analysis.fitness.pieces import Samples
from procedures.core import units
from procedures.core.recording import ACCELEROMETER, GYRO, TRIADS, Channel, NominalScale, Quantity

BURST = 128
"""Samples that are averaged before a magnitude is taken, so that noise does not pass for a reading."""
BURSTS = 8
"""Of these at the beginning of a piece."""
TOLERANCE = 0.3
"""Of the magnitude of gravity, relative: nominal scales are known to some per cent, but the thesis's own unit (its
table 5.1) gives 0.81 … 0.86 of its input; the nearest wrong unit, feet, is a factor of 3.3 away."""
COLDEST_C, HOTTEST_C = -100.0, 200.0
GYRO_QUANTITIES = (Quantity.ANGLE_INCREMENT, Quantity.ANGULAR_RATE)


class Readings:
    """Mean magnitudes of what triads and single channels read, over short bursts throughout the recording."""

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
        """New samples of all channels, (channels, n)."""
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

    def doubts(self, settings: FitnessSettings) -> dict[str, tuple[str, bool]]:
        """For each channel in doubt: a sentence, and whether it is certain to be wrong."""
        if not self._pieces or not settings.at_rest:
            return self._temperatures() if self._pieces else {}
        return {**self._temperatures(), **self._accelerometers(settings), **self._gyros(settings)}

    def _temperatures(self) -> dict[str, tuple[str, bool]]:
        found: dict[str, tuple[str, bool]] = {}
        for channel, total in zip(self._channels, self._sums, strict=True):
            mean = float(total) / self._pieces
            if channel.unit == "degC" and not COLDEST_C <= mean <= HOTTEST_C:
                kelvin = ": it looks like kelvins" if HOTTEST_C < mean < 500.0 else ""
                told = f"{COLDEST_C:g} … {HOTTEST_C:g} °C were expected{kelvin}"
                found[channel.name] = (f"channel {channel.name} reads {mean:.4g} °C where {told}", True)
        return found

    def _accelerometers(self, settings: FitnessSettings) -> dict[str, tuple[str, bool]]:
        rows = self._triads.get("accelerometer")
        if rows is None:
            return {}
        gravity = settings.gravity_m_s2 or units.STANDARD_GRAVITY
        read = self._magnitudes["accelerometer"] / self._pieces
        if abs(read / gravity - 1.0) <= TOLERANCE:
            return {}
        candidates = {
            "g": 1.0 / units.STANDARD_GRAVITY,
            "mg": 1e3 / units.STANDARD_GRAVITY,
            "µg": 1e6 / units.STANDARD_GRAVITY,
            "cm/s² (Gal)": 100.0,
            "mm/s²": 1000.0,
        }
        return self._told(rows, ACCELEROMETER, read, f"gravity, {gravity:.5g} m/s² ± 30 %", gravity, candidates)

    def _gyros(self, settings: FitnessSettings) -> dict[str, tuple[str, bool]]:
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
        # A good gyro reads the Earth's rate or little more; what another reads shows that its unit is wrong, not which.
        good = limit < 10.0 * units.EARTH_RATE
        candidates = {"deg/s": 1.0 / units.DEG, "deg/h": 1.0 / units.DEG_PER_HOUR} if good else {}
        expected = f"less than {limit:.3g} rad/s at rest"
        found: dict[str, tuple[str, bool]] = {}
        for group, value in read.items():
            if value > limit:
                names = [self._names[i] for i in group]
                found.update(self._told(group, names, value, expected, units.EARTH_RATE, candidates))
        return found

    def _told(
        self,
        rows: Sequence[int],
        names: Sequence[str],
        read: float,
        expected: str,
        truth: float,
        candidates: dict[str, float],
    ) -> dict[str, tuple[str, bool]]:
        """The sentence for channels that read `read` where `truth` is so in the unit declared."""
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
        return {self._names[row]: (sentence, bool(looks)) for row in rows}

    def _rows(self, triad: Sequence[str]) -> list[int]:
        """Where a triad stands, whole and in SI; nothing otherwise."""
        wanted = "rad/s" if triad == GYRO else "m/s^2"
        rows = [self._names.index(name) for name in triad if name in self._names]
        return rows if len(rows) == 3 and all(self._channels[r].rate_unit == wanted for r in rows) else []
