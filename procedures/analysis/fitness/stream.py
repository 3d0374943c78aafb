"""The inspection itself: blocks in, findings out, one pass and bounded memory whatever the recording's length."""

from collections.abc import Callable, Sequence
from typing import cast

import numpy as np
from numpy.typing import NDArray

from procedures.analysis.fitness.bits import Bits
from procedures.analysis.fitness.edges import RAILS, Edge, counted
from procedures.analysis.fitness.findings import ChannelFitness, Finding, FitnessSettings, Kind, Severity
from procedures.analysis.fitness.jumps import SIGMAS, Jumps
from procedures.analysis.fitness.pieces import Mask, Piece, Pieces, Samples
from procedures.analysis.fitness.plausibility import Readings
from procedures.analysis.fitness.repeats import Repeats
from procedures.core.arrays import Array
from procedures.core.errors import BadParameter
from procedures.core.recording import INCREMENTS, Channel, RawArray, Recording

SHORT_RUN = 10
"""Rows: a data link that repeats fewer has stumbled, one that repeats more was hung."""

_SPOILS_NOISE = (Kind.SATURATED, Kind.REPEATED)

_Look = Callable[[int, str], list[Finding]]


class FitnessStream:
    """Inspects a recording block by block; the findings do not depend on how it was cut into blocks."""

    def __init__(
        self,
        channels: Sequence[Channel],
        rate_hz: float,
        count: int | None = None,
        settings: FitnessSettings | None = None,
    ) -> None:
        """`count`: samples that are announced; None: not known."""
        if not 0.0 < rate_hz < np.inf:
            raise BadParameter("rate_hz", rate_hz, "must be finite and greater than 0")
        self._channels = tuple(channels)
        self._rate_hz = rate_hz
        self._count = count
        self._settings = settings or FitnessSettings()
        number = len(self._channels)
        self._pieces = Pieces(number)
        self._edges = [(Edge(+1), Edge(-1)) for _ in range(number)]
        self._bits = [Bits() for _ in range(number)]
        self._repeats = Repeats(number)
        self._jumps = Jumps(number)
        self._readings = Readings(self._channels, rate_hz)
        self._missing = np.zeros(number, np.int64)
        self._first_missing = [0] * number
        self._is_integer = False

    def add(self, block: RawArray) -> None:
        """The next samples, shape (n, channels), int32 or float64. Raises `BadParameter` for another shape."""
        for piece in self._pieces.add(block):
            self._inspect(piece)

    def finish(self) -> tuple[ChannelFitness, ...]:
        """What was found, channel by channel; no block may follow."""
        for piece in self._pieces.finish():
            self._inspect(piece)
        self._repeats.finish()
        seen, least = self._pieces.seen, self._settings.least_samples
        looks: tuple[_Look, ...] = (self._missing_samples, self._constant)
        if seen >= least:
            looks = (*looks, self._saturated, self._coarse_bits, self._repeated, self._wrong_unit)
        found: list[ChannelFitness] = []
        for c, channel in enumerate(self._channels):
            findings = self._length(channel.name)
            for look in looks if seen else ():
                findings += look(c, channel.name)
            # Noise is not what it was where samples pile up or repeat: nothing can be said of jumps against it.
            if seen >= least and not any(f.kind in _SPOILS_NOISE and f.severity is Severity.REFUSE for f in findings):
                findings += self._jumped(c, channel.name)
            found.append(ChannelFitness(channel.name, tuple(findings)))
        return tuple(found)

    def _inspect(self, piece: Piece) -> None:
        x, start = piece.x, piece.start
        self._is_integer = piece.is_integer
        if x.shape[1]:
            same = piece.d == 0
            self._repeats.add(same, piece.missing, start + x.shape[1] - same.shape[1])
            self._extremes(x, same, start)
            if piece.missing is not None:
                self._count_missing(piece.missing, start)
            self._readings.add(x)
        if self._settings.at_rest:
            self._jumps.add(piece, self._resolution())

    def _extremes(self, x: Samples, same: Mask, start: int) -> None:
        low, high = x.min(axis=1).tolist(), x.max(axis=1).tolist()
        whole = cast(NDArray[np.int32], x) if self._is_integer else np.empty((len(x), 0), np.int32)
        ones, zeros = np.bitwise_or.reduce(whole, axis=1), np.bitwise_and.reduce(whole, axis=1)
        for c, row in enumerate(x):
            few = counted(row, low[c], high[c]) if self._is_integer else None
            top, bottom = self._edges[c]
            top.add(row, float(high[c]), same[c], start, few)
            bottom.add(row, float(low[c]), same[c], start, few)
            if self._is_integer:
                self._bits[c].add(whole[c], np.int32(ones[c]), np.int32(zeros[c]))

    def _count_missing(self, missing: Mask, start: int) -> None:
        for c, row in enumerate(missing):
            if row.any():
                if not self._missing[c]:
                    self._first_missing[c] = start + int(np.argmax(row))
                self._missing[c] += np.count_nonzero(row)

    def _resolution(self) -> Array:
        """One count or the power of two that all values are multiples of; 0 for samples that are no integers."""
        return np.array([float(1 << b.lowest) if self._is_integer else 0.0 for b in self._bits])

    def _length(self, name: str) -> list[Finding]:
        seen, least = self._pieces.seen, self._settings.least_samples
        found: list[Finding] = []
        if seen < least:
            told = f"channel {name}: {seen} samples are too few, at least {least} are needed"
            found.append(Finding(Kind.TOO_FEW, Severity.REFUSE, told, count=seen))
        if self._count is not None and seen != self._count:
            told = f"channel {name}: {seen} samples where {self._count} are announced"
            found.append(Finding(Kind.INCOMPLETE, Severity.REFUSE, told, count=seen))
        return found

    def _missing_samples(self, c: int, name: str) -> list[Finding]:
        count = int(self._missing[c])
        if not count:
            return []
        severity = Severity.REFUSE if self._settings.gaps == "refuse" else Severity.WARN
        first = self._first_missing[c]
        treated = "" if severity is Severity.REFUSE else "; they are left out as gaps"
        told = (
            f"channel {name}: {self._share(count)} {'are' if count > 1 else 'is'} not a finite number, "
            f"the first is sample {self._at(first)}{treated}"
        )
        return [Finding(Kind.NOT_FINITE, severity, told, first, count)]

    def _constant(self, c: int, name: str) -> list[Finding]:
        top, bottom = self._edges[c]
        seen = self._pieces.seen
        if seen < 2 or self._missing[c] == seen or top.extreme != bottom.extreme:
            return []
        value = top.extreme
        railed = self._is_integer and value in RAILS
        rail = ", the end of its range" if railed else ""
        told = f"channel {name} reads {value:.9g}{rail} throughout all {seen} samples; a live channel shows noise"
        counter = self._is_integer and self._channels[c].quantity in INCREMENTS and not railed
        silent = counter and self._settings.counters_may_rest
        return [Finding(Kind.CONSTANT, Severity.WARN if silent else Severity.REFUSE, told, 0, seen)]

    def _saturated(self, c: int, name: str) -> list[Finding]:
        found: list[Finding] = []
        seen, repeats = self._pieces.seen, int(self._repeats.zeros[c])
        for edge, other in (self._edges[c], self._edges[c][::-1]):
            if self._constant(c, name):
                continue
            value, count = edge.extreme, edge.count
            word = "largest" if edge.sign > 0 else "smallest"
            begin = f"channel {name}: {self._share(count)} {'stand' if count > 1 else 'stands'} at {value:.9g}, "
            end = f"; saturated, first at sample {self._at(edge.first_index)}"
            if self._is_integer and value in RAILS:
                severity = Severity.REFUSE if count > 1 else Severity.WARN
                found.append(
                    Finding(Kind.SATURATED, severity, f"{begin}the end of its range{end}", edge.first_index, count)
                )
            elif edge.piles_up(repeats, seen, other):
                told = f"{begin}the {word}, and no more than {edge.near} at any of the next three values"
                found.append(Finding(Kind.SATURATED, Severity.REFUSE, f"{told}{end}", edge.first_index, count))
        return found

    def _coarse_bits(self, c: int, name: str) -> list[Finding]:
        if not self._is_integer:
            return []
        bits, seen = self._bits[c], self._pieces.seen
        found: list[Finding] = []
        for bit, value in bits.stuck().items():
            told = (
                f"channel {name}: bit {bit} (of {1 << bit} counts) is stuck at {value}: "
                "it never changes though bits above and below it do"
            )
            found.append(Finding(Kind.STUCK_BIT, Severity.REFUSE, told, 0, seen))
        if bits.coarse():
            step, rest = 1 << bits.coarse(), bits.remainder()
            plus = f" plus {rest}" if rest else ""
            told = f"channel {name}: all values are multiples of {step}{plus}: its resolution is {step} counts"
            found.append(Finding(Kind.RESOLUTION, Severity.WARN, told, 0, seen))
        return found

    def _repeated(self, c: int, name: str) -> list[Finding]:
        found: list[Finding] = []
        hung, held = self._repeats.hung(), self._repeats.held()
        if hung is not None and c in hung[1]:
            run = hung[0]
            told = (
                f"{run.length} rows in a row repeat the one before exactly, from sample {self._at(run.first_index)}: "
                "the data link seems to have hung"
            )
            severity = Severity.REFUSE if run.length >= SHORT_RUN else Severity.WARN
            found.append(Finding(Kind.REPEATED, severity, told, run.first_index, run.length))
        if c in held:
            rows = self._repeats.rows
            told = (
                f"{self._share(rows)} repeat the row before in all channels at once, the first is "
                f"{self._at(self._repeats.first_index)}: rows seem to be sent more than once"
            )
            found.append(Finding(Kind.REPEATED, Severity.REFUSE, told, self._repeats.first_index, rows))
        return found

    def _jumped(self, c: int, name: str) -> list[Finding]:
        jumps = self._jumps
        found: list[Finding] = []
        outlier, step = jumps.first_outlier[c], jumps.first_step[c]
        if outlier is not None:
            index, away, noise = outlier
            told = (
                f"channel {name}: {self._share(int(jumps.outliers[c]))} far from both neighbours; the first is sample "
                f"{self._at(index)}, {away:.6g} away where {SIGMAS:g} times the noise of {noise:.3g} was allowed"
            )
            found.append(Finding(Kind.OUTLIER, Severity.WARN, told, index, int(jumps.outliers[c])))
        if step is not None:
            index, height, noise = step
            told = (
                f"channel {name}: the level shifts {int(jumps.steps[c])} times between two samples; the first time at "
                f"sample {self._at(index)}, by {height:.6g} where {SIGMAS:g} times the noise of {noise:.3g} was allowed"
            )
            found.append(Finding(Kind.STEP, Severity.WARN, told, index, int(jumps.steps[c])))
        return found

    def _wrong_unit(self, c: int, name: str) -> list[Finding]:
        doubt = self._readings.doubts(self._settings).get(name)
        if doubt is None:
            return []
        return [
            Finding(Kind.WRONG_UNIT, Severity.REFUSE if doubt[1] else Severity.WARN, doubt[0], 0, self._pieces.seen)
        ]

    def _share(self, count: int) -> str:
        seen = self._pieces.seen
        return f"{count} of {seen} samples" + (f" ({100.0 * count / seen:.2g} %)" if 1000 * count >= seen else "")

    def _at(self, index: int) -> str:
        return f"{index} ({index / self._rate_hz:.6g} s)"


def inspect(recording: Recording, settings: FitnessSettings | None = None) -> tuple[ChannelFitness, ...]:
    """All findings of a recording, one pass over it."""
    info = recording.info
    stream = FitnessStream(info.channels, info.rate_hz, info.count, settings)
    for block in recording.blocks():
        stream.add(block)
    return stream.finish()
