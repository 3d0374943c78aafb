"""Inspection of a recording: blocks in, findings out, in one pass and in bounded memory for any length."""

from collections.abc import Sequence
from typing import cast

import numpy as np
from numpy.typing import NDArray

from procedures.analysis.fitness import raw_flaws, time_flaws
from procedures.analysis.fitness.bits import Bits
from procedures.analysis.fitness.copies import Copies
from procedures.analysis.fitness.counters import Counters
from procedures.analysis.fitness.edges import Edge, counted
from procedures.analysis.fitness.findings import ChannelFitness, Finding, FitnessSettings, Kind, Severity
from procedures.analysis.fitness.jumps import WHITE, Jump, Jumps
from procedures.analysis.fitness.levels import Levels
from procedures.analysis.fitness.misreadings import Misread, Misreadings
from procedures.analysis.fitness.pieces import Mask, Piece, Pieces, Samples
from procedures.analysis.fitness.plausibility import Readings, unlikely_rate
from procedures.analysis.fitness.repeats import Repeats
from procedures.analysis.fitness.stalls import Stalls, groups_of
from procedures.analysis.fitness.twins import Twins
from procedures.analysis.fitness.wording import Wording
from procedures.analysis.fitness.wraps import Wraps
from procedures.core.arrays import Array
from procedures.core.errors import BadParameter
from procedures.core.recording import AROUND, INCREMENTS, Channel, RawArray, Recording

_SPOILS_NOISE = (Kind.REPEATED, Kind.STANDS_STILL, Kind.COPIED, Kind.WRAPPED, Kind.CONSTANT, Kind.EVEN_STEPS)

_FALSIFIES = (Kind.WRAPPED, Kind.CONSTANT, Kind.EVEN_STEPS, Kind.WRONG_UNIT)
"""Findings after which the readings of a channel say nothing more of its unit or rate."""

FEW_SHARE = 1e-3
"""Greatest share of outliers for which a result without them still represents the channel."""


class FitnessStream:
    """Inspection of a recording block by block; the findings do not depend on how it was cut into blocks."""

    def __init__(
        self,
        channels: Sequence[Channel],
        rate_hz: float,
        count: int | None = None,
        settings: FitnessSettings | None = None,
    ) -> None:
        """Start with no samples; `count`: the announced number of samples, None where not known."""
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
        self._stalls = Stalls(groups_of(self._channels), number)
        self._copies = Copies(number)
        self._twins = Twins(self._channels)
        self._counters = Counters()
        self._jumps = Jumps(number)
        self._levels = Levels(number, count)
        self._wraps = Wraps([c.scale if c.unit == "degC" else None for c in self._channels])
        self._readings = Readings(self._channels, rate_hz)
        self._first_change = [-1] * number
        self._misreadings = Misreadings(self._channels, rate_hz)
        self._missing = np.zeros(number, np.int64)
        self._first_missing = [0] * number
        self._is_integer = False

    def add(self, block: RawArray) -> None:
        """Inspect the next samples, shape (n, channels), int32 or float64. Raises `BadParameter` for another shape."""
        with np.errstate(over="ignore", invalid="ignore"):  # of absurd values, which are refused at the end
            for piece in self._pieces.add(block):
                self._inspect(piece)

    def finish(self) -> tuple[ChannelFitness, ...]:
        """Return the findings, channel by channel; no block may follow."""
        with np.errstate(over="ignore", invalid="ignore"):
            return self._findings()

    def _findings(self) -> tuple[ChannelFitness, ...]:
        for piece in self._pieces.finish():
            self._inspect(piece)
        words = Wording(self._pieces.seen, self._rate_hz)
        self._misreadings.finish(words.seen)
        found = [self._of_values(c, channel, words) for c, channel in enumerate(self._channels)]
        if words.seen >= max(self._settings.least_samples, 2):
            self._of_repeats(found, words)
            self._of_foreign_values(found, words)
            self._of_readings(found, words)
            if self._settings.at_rest:
                self._of_course(found, words)
        told = unlikely_rate(self._rate_hz)
        if told is not None and any(c.quantity not in AROUND for c in self._channels):
            for findings in found:
                findings.append(Finding(Kind.UNLIKELY_RATE, Severity.WARN, told, of_row=True))
        return tuple(ChannelFitness(c.name, tuple(f)) for c, f in zip(self._channels, found, strict=True))

    def outliers(self) -> dict[int, list[Jump]]:
        """Return the outliers of each column, where they are few enough to be omitted; no misread temperatures."""
        misread = self.misread()
        return {c: jumps for c, jumps in enumerate(self._jumps.outliers) if jumps and self._few(c) and c not in misread}

    def misread(self) -> dict[int, list[Misread]]:
        """Return the runs of readings that are no temperatures of each column, where they are few enough."""
        return self._misreadings.runs()

    def _few(self, c: int) -> bool:
        count = int(self._jumps.outlier_count[c])
        return count == len(self._jumps.outliers[c]) and count <= max(FEW_SHARE * self._pieces.seen, 1.0)

    def _inspect(self, piece: Piece) -> None:
        x, start = piece.x, piece.start
        self._is_integer = piece.is_integer
        if x.shape[1]:
            same: Mask = piece.d == 0
            if piece.missing is not None:
                same &= ~piece.missing[:, x.shape[1] - same.shape[1] :]
                self._count_missing(piece.missing, start)
            self._extremes(x, same, start)
            zeros = np.array([np.count_nonzero(row) for row in same], np.int64)
            first = start + x.shape[1] - same.shape[1]
            for c in np.flatnonzero(zeros < same.shape[1]).tolist():
                if self._first_change[c] < 0:
                    self._first_change[c] = first + int(np.argmin(same[c]))
            self._repeats.add(same, zeros, first)
            self._stalls.add(same, zeros, first)
            resolution = self._resolution()
            if not start:
                self._copies.note_values(x, same)
            self._copies.add(piece.d, resolution)
            self._twins.add(piece.d)
            self._counters.add(piece.d)
            self._levels.add(piece)
            self._wraps.add(piece)
            self._misreadings.add(piece)
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

    def _of_values(self, c: int, channel: Channel, words: Wording) -> list[Finding]:
        """Findings on length, missing samples, and the values of one channel alone."""
        settings, edges = self._settings, self._edges[c]
        found = raw_flaws.length(channel.name, words.seen, self._count, settings)
        if not words.seen:
            return found
        lost = int(self._missing[c])
        found += raw_flaws.missing(channel.name, lost, self._first_missing[c], words, settings)
        if raw_flaws.is_constant(edges, lost, words.seen):
            return found + raw_flaws.constant(channel, edges[0].extreme, self._is_integer, words, settings)
        if words.seen < settings.least_samples or lost == words.seen:
            return found
        impossible = raw_flaws.impossible_values(channel, edges[1].extreme, edges[0].extreme, words)
        if impossible:
            return impossible
        changes = self._repeats.pairs - int(self._repeats.zeros[c])
        if not lost and raw_flaws.is_dead(channel, changes, words.seen, self._is_integer, settings):
            values = edges[1].extreme, edges[0].extreme
            return found + raw_flaws.dead(channel, values, changes, self._first_change[c], words)
        wrap = self._wraps.found(c, edges[1].extreme, edges[0].extreme)
        if wrap is not None and not self._misreadings.explains(c, wrap.count):
            return found + raw_flaws.wrapped(channel, wrap, words)
        found += self._misreadings.finding(c, settings.mends_outliers, words)
        found += raw_flaws.saturated(channel.name, edges, self._is_integer, int(self._repeats.zeros[c]), words)
        return found + (raw_flaws.coarse_bits(channel.name, self._bits[c], words.seen) if self._is_integer else [])

    def _of_repeats(self, found: list[list[Finding]], words: Wording) -> None:
        """Add findings on repeated rows, copied channels, hung links, and channels that stand still."""
        sampled = np.array([c.quantity not in INCREMENTS for c in self._channels])
        groups = self._stalls.finish(sampled | self._copies.fine())
        rows = self._repeats.rows
        hung = sum(run.length for group in groups if len(group.rows) == len(self._channels) for run in group.runs)
        held = self._repeats.held(hung, self._copies.fine())
        live = [c for c, f in enumerate(found) if not any(x.kind in (Kind.CONSTANT, Kind.SATURATED) for x in f)]
        copied = [
            c for c in self._copies.copied(self._stalls.inside / max(words.seen, 1)) if c in live and c not in held
        ]
        witnesses = [c for c in live if self._repeats.zeros[c] < 0.5 * self._repeats.pairs and c not in copied]
        for group in groups:
            if not group.runs or any(c in held or c in copied for c in group.rows):
                continue
            if len(group.rows) == len(self._channels):
                finding = time_flaws.hung(group, words)
            else:
                finding = time_flaws.stands_still(group, [self._channels[c].name for c in group.rows], words)
            for c in group.rows:
                if c in live:
                    found[c].append(finding)
        if held:
            rate = self._rate_hz * (1.0 - rows / max(self._repeats.pairs, 1))
            told = (
                f"{words.share(rows)} repeat the row before in all channels at once, the first is "
                f"{words.at(self._repeats.first_index)}: rows seem to be sent more than once, as if the true rate were "
                f"{rate:.4g} Hz"
            )
            severity = Severity.WARN if self._settings.means_only else Severity.REFUSE
            for c in held:
                found[c].append(Finding(Kind.REPEATED, severity, told, self._repeats.first_index, rows, of_row=True))
        for together in time_flaws.alike(copied, self._channels, self._repeats.zeros):
            names = [self._channels[c].name for c in together]
            repeats = int(self._repeats.zeros[together[0]])
            # A copied sample cannot have repeated by chance; some of the other samples did, and are no copies.
            repeats -= round(self._copies.by_chance(together[0]) * words.seen)
            value = self._copies.at_one_value.get(together[0])
            finding = time_flaws.copied(names, repeats, not witnesses and not held, value, words, self._settings)
            for c in together:
                found[c].append(finding)

    def _of_foreign_values(self, found: list[list[Finding]], words: Wording) -> None:
        """Add findings on values that are not a sensor's own: another channel's, those of an earlier part of the
        recording, a counter's.
        """
        for twin in self._twins.found():
            channel, of = self._channels[twin.column], self._channels[twin.of]
            found[twin.column].append(raw_flaws.twin(channel, of, twin.ratio, words))
        own = [c for c, channel in enumerate(self._channels) if channel.quantity not in AROUND and not found[c]]
        if own and not self._missing.any() and all(2 * self._repeats.zeros[c] < self._repeats.pairs for c in own):
            for flaw in raw_flaws.repeats_itself([self._edges[c] for c in own], words, self._settings):
                for c in own:
                    found[c].append(flaw)
        for c, step in self._counters.found().items():
            if self._settings.at_rest and self._channels[c].quantity not in AROUND:
                found[c] = [raw_flaws.grows_evenly(self._channels[c], step, words)]

    def _of_readings(self, found: list[list[Finding]], words: Wording) -> None:
        """Add findings on units and rates that contradict the readings of a unit at rest."""
        cells = self._levels.finish()
        noise, mean = cells.noise, cells.means.mean(axis=1) if cells.means.shape[1] else np.full(len(found), np.nan)
        usual = np.median(noise, axis=1) / WHITE if noise.shape[1] else np.zeros(len(found))
        doubts = self._readings.doubts(self._settings, mean, usual)
        for c, channel in enumerate(self._channels):
            doubt = doubts.get(channel.name)
            if doubt is None or any(f.kind in _FALSIFIES for f in found[c]):
                continue
            kind = Kind.WRONG_RATE if doubt.of_rate else Kind.WRONG_UNIT
            refused = doubt.certain and not (doubt.of_rate and self._settings.seeks_scale)
            severity = Severity.REFUSE if refused else Severity.WARN
            found[c].append(Finding(kind, severity, doubt.sentence, 0, words.seen, of_row=doubt.of_rate))

    def _of_course(self, found: list[list[Finding]], words: Wording) -> None:
        """Add findings on outliers, steps and changes of the noise, unless piled-up samples falsify the noise."""
        cells = self._levels.finish()
        for c, jumps in enumerate(self._jumps.outliers):
            cells.leave_out(c, [jump.index for jump in jumps])
        step = np.where(np.isfinite(self._copies.step), self._copies.step, 0.0)
        level, noise = time_flaws.steps_and_noise(cells, step)
        for c, channel in enumerate(self._channels):
            refused = any(f.kind is Kind.SATURATED and f.severity is Severity.REFUSE for f in found[c])
            if refused or any(f.kind in _SPOILS_NOISE for f in found[c]):
                continue
            if any(f.kind is Kind.MISREAD for f in found[c]):
                continue
            jumps = self._jumps
            count = int(jumps.outlier_count[c])
            mended = self._settings.mends_outliers and self._few(c)
            found[c] += time_flaws.outliers(channel, jumps.outliers[c], count, mended, words)
            if channel.quantity not in AROUND:
                found[c] += time_flaws.steps(channel, jumps.steps[c], level[c], cells.size, words)
                found[c] += time_flaws.noise_changes(channel, noise[c], cells.size * cells.group, words)


def inspect(recording: Recording, settings: FitnessSettings | None = None) -> tuple[ChannelFitness, ...]:
    """Return all findings of a recording, channel by channel, from one pass over it. `settings` None: the defaults of
    `FitnessSettings`.
    """
    info = recording.info
    stream = FitnessStream(info.channels, info.rate_hz, info.count, settings)
    for block in recording.blocks():
        stream.add(block)
    return stream.finish()
