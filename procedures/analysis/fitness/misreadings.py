"""Readings of a thermometer that no thermal mass makes: error codes and lost digits, a jump away and a jump back.

A digital sensor answers −127 °C, 85 °C or 0 K instead of a temperature where a transfer fails. Such a reading lies a
jump away from the readings on both sides, which agree with each other; a temperature of a unit takes longer.
"""

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from procedures.analysis.fitness.findings import Finding, Kind, Severity
from procedures.analysis.fitness.pieces import Piece, Samples
from procedures.analysis.fitness.plausibility import COLDEST_C, HOTTEST_C
from procedures.analysis.fitness.wording import Wording
from procedures.core.arrays import Array
from procedures.core.recording import Channel, RawArray

JUMP_K, SLEW_K_S, SLOWEST_S = 5.0, 1.0, 10.0
"""Least jump: `JUMP_K`, and the change of the fastest thermometer, `SLEW_K_S`, from one sample to the next or within
`SLOWEST_S`, whichever is shorter."""
SIGMAS = 12.0
"""Least jump of a noisy sensor, in medians of the distances between neighbouring samples."""
LONGEST_S = 60.0
"""Longest run of such readings, where each is a possible temperature."""
POWER_ON_C = 85.0
"""Reading of a sensor that was reset. Where samples are more than `SLOWEST_S` apart, only it and impossible
temperatures count."""
MOST_SHARE = 0.2
"""Greatest share of such readings in a channel that is used without them."""
KEPT = 20_000
"""Most runs that are kept for a channel; one with more is not used without them."""


@dataclass(frozen=True)
class Misread:
    """A run of readings that are no temperatures: first sample, the one after the last, readings on either side."""

    start: int
    stop: int
    before: float
    """Reading before it [raw]; at the beginning of a recording that after it."""
    after: float
    """Reading after it [raw]; at the end of a recording that before it."""
    value: float
    """First reading of the run [raw]."""

    def mended(self, indices: NDArray[np.int64], values: RawArray) -> Array:
        """Return, for the samples at some indices (n,) of the run, the straight line between the readings on either
        side, in whole numbers where `values` (n,) are.
        """
        line = self.before + (self.after - self.before) * (indices - self.start + 1.0) / (self.stop - self.start + 1)
        return np.rint(line) if np.issubdtype(values.dtype, np.integer) else line


class Misreadings:
    """Running search for such readings in the temperatures of a recording."""

    def __init__(self, channels: Sequence[Channel], rate_hz: float) -> None:
        self._of = {c: _Thermometer(one, rate_hz) for c, one in enumerate(channels) if one.unit == "degC"}

    def add(self, piece: Piece) -> None:
        """Add the next piece of samples."""
        for c, thermometer in self._of.items():
            if piece.missing is None or not piece.missing[c].any():
                thermometer.add(piece.x[c], piece.d[c], piece.start)

    def finish(self, seen: int) -> None:
        """Close a run that lasts to the end of the recording, of `seen` samples."""
        for thermometer in self._of.values():
            thermometer.end(seen)

    def runs(self) -> dict[int, list[Misread]]:
        """Return the runs of each column that has some, and few enough for the other readings to stand in."""
        return {c: t.runs for c, t in self._of.items() if t.runs and t.few}

    def explains(self, c: int, jumps: int) -> bool:
        """Return whether the runs of a column account for so many jumps."""
        return c in self._of and 2 * len(self._of[c].runs) >= jumps

    def finding(self, c: int, mended: bool, words: Wording) -> list[Finding]:
        """Return the finding on one column; `mended`: the results are computed without such readings."""
        thermometer = self._of.get(c)
        if thermometer is None or not thermometer.runs:
            return []
        few, count, first = thermometer.few, thermometer.count, thermometer.runs[0].start
        told = (
            f"channel {thermometer.channel.name}: {words.share(count)} {'are' if count > 1 else 'is'} no temperature, "
            f"{thermometer.shown()}, first at sample {words.at(first)}: nothing warms or cools so fast and back"
        )
        if not few:
            told += "; too many to do without: correct the column, or analyse without this channel"
        elif mended:
            told += "; a straight line between the readings before and after stands in"
        else:
            told += "; the figures include them"
        return [Finding(Kind.MISREAD, Severity.WARN if few else Severity.REFUSE, told, first, count)]


class _Thermometer:
    """Search in one channel, jump by jump."""

    def __init__(self, channel: Channel, rate_hz: float) -> None:
        self.channel = channel
        self.runs: list[Misread] = []
        self.count = 0
        self._is_full = False
        """True: runs were found that are not kept."""
        self._step_s = 1.0 / rate_hz
        self._longest = max(1, round(LONGEST_S * rate_hz))
        self._seen = 0
        self._usual = 0.0
        """Median of the first piece [raw], to judge a recording that begins with such readings."""
        self._jumped = False
        self._start: int | None = None
        self._before = self._value = 0.0
        self._possible = False

    @property
    def few(self) -> bool:
        """True if the other readings can stand in."""
        return not self._is_full and self.count <= MOST_SHARE * self._seen

    def add(self, x: Samples, d: Samples, start: int) -> None:
        """Take in new samples (n,) from index `start`, and their distances from the ones before, (n,) or (n − 1,)."""
        if not self._seen:
            self._usual = float(np.median(x))
        self._seen = start + len(x)
        if not len(d):
            return
        least = (JUMP_K + SLEW_K_S * min(self._step_s, SLOWEST_S)) / abs(self.channel.scale)
        if max(float(d.max()), -float(d.min())) <= least:
            return
        size = np.abs(d.astype(np.float64))
        least = max(least, SIGMAS * float(np.median(size)))
        late = len(x) - len(d)
        for j in np.flatnonzero(size > least).tolist():
            value = float(x[j + late])
            self._jump(start + j + late, value - float(d[j]), value, least)

    def _jump(self, index: int, previous: float, value: float, least: float) -> None:
        """Take in one jump from `previous` to `value`, at a sample."""
        first, self._jumped = not self._jumped, True
        if self._start is None:
            unusual = abs(previous - self._usual) > abs(value - self._usual)
            if first and unusual and self._is_code(previous) and self._allowed(0, index, previous):
                self._take(Misread(0, index, value, value, previous))
            else:
                self._begin(index, previous, value)
        elif abs(value - self._before) <= least:
            if self._allowed(self._start, index, self._value):
                self._take(Misread(self._start, index, self._before, value, self._value))
            self._start = None
        elif index - self._start > self._longest and self._possible:
            self._begin(index, previous, value)
        else:
            self._possible = self._possible or self._is_possible(value)

    def end(self, seen: int) -> None:
        """Close a run that the recording ends with."""
        if self._start is not None and self._is_code(self._value) and self._allowed(self._start, seen, self._value):
            self._take(Misread(self._start, seen, self._before, self._before, self._value))
        self._start = None

    def _begin(self, index: int, previous: float, value: float) -> None:
        self._start, self._before, self._value = index, previous, value
        self._possible = self._is_possible(value)

    def _allowed(self, start: int, stop: int, value: float) -> bool:
        """Return whether a run of this length, from this value on, is one of misreadings."""
        if not self._is_possible(value):
            return True
        return stop - start <= self._longest and (self._step_s <= SLOWEST_S or self._is_code(value))

    def _take(self, run: Misread) -> None:
        self.count += run.stop - run.start
        if len(self.runs) < KEPT:
            self.runs.append(run)
        else:
            self._is_full = True

    def _is_code(self, value: float) -> bool:
        """Return whether a value is a known code: at an end of a recording one jump alone proves nothing."""
        reset = abs(self._celsius(value) - POWER_ON_C) < 0.5 * abs(self.channel.scale)
        return reset or not self._is_possible(value)

    def _celsius(self, raw: float) -> float:
        return (raw - self.channel.offset) * self.channel.scale

    def _is_possible(self, raw: float) -> bool:
        return COLDEST_C <= self._celsius(raw) <= HOTTEST_C

    def shown(self) -> str:
        """Return the phrase on the commonest values, "-127 °C (70 times), 85 °C (twice)"."""
        common = Counter(f"{self._celsius(run.value):.6g} °C" for run in self.runs).most_common(3)
        return ", ".join(f"{value} ({'once' if n == 1 else f'{n} times'})" for value, n in common)
