"""Runs of exact repeats longer than chance: rows that hang, triads or channels that stand still while others move."""

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from procedures.analysis.fitness.pieces import Mask
from procedures.core.arrays import Array
from procedures.core.recording import TRIADS, Channel

SHORTEST = 5
"""Fewest consecutive repeats of a run."""
BUSY = 0.6
"""A channel counts as evidence if a smaller share of its samples repeat the previous one."""
CHANCE = 1e-9
"""Accepted probability of a false alarm per recording and group."""
WINDOW = 64
"""Samples of a window in which the share of repeats is determined."""
USUAL = 0.8
"""A run is judged against this quantile of the windows of its piece: a channel whose level drifts between two counts
repeats more often at some times than at others."""
NEAR = 256
"""Samples on each side of a run that show how often its channels repeat, and repeat together, at that time."""
LEAST_PART = 1e-3
"""Least share of repeats that a channel is assumed to have."""
KEPT = 1000
"""Most runs that are kept for a group."""
SAME = 0.8
"""Share of a run that must lie within a larger group's run for both to be the same."""


@dataclass(frozen=True)
class Run:
    """Run of samples `first_index` … `first_index` + `length` − 1, each of which repeats the one before it."""

    first_index: int
    length: int


@dataclass(frozen=True)
class Around:
    """Shares of samples that repeat the previous one, outside of a run."""

    parts: Array
    """Share of each channel, (channels,)."""
    together: float
    """Share of all channels of the group at once."""


@dataclass
class Group:
    """Channels that are examined together: all of them, a triad, or one."""

    rows: tuple[int, ...]
    runs: list[Run] = field(default_factory=list[Run])
    lost: int = 0
    """Number of runs beyond those that are kept."""
    open: int = 0
    """Repeats at the end of the previous piece, which a run may continue."""


def groups_of(channels: Sequence[Channel]) -> list[tuple[int, ...]]:
    """Return the columns of the groups that may stand still: all channels, each whole triad, each channel alone."""
    names = [c.name for c in channels]
    triads = [tuple(names.index(n) for n in triad) for triad in TRIADS.values() if all(n in names for n in triad)]
    everything = tuple(range(len(channels)))
    larger = [everything, *(t for t in triads if len(t) < len(everything))] if len(channels) > 1 else []
    return [*larger, *((c,) for c in everything)]


class Stalls:
    """Running search for runs of repeats, of all groups of channels, piece by piece."""

    def __init__(self, groups: Sequence[tuple[int, ...]], channels: int) -> None:
        """Start with no samples; `groups`: columns of channels, the larger groups first."""
        self._groups = [Group(rows) for rows in groups]
        self._part = np.full(channels, np.nan)
        self.repeats = np.zeros(channels, np.int64)
        self.inside = np.zeros(channels, np.int64)
        """Repeats that lie in runs, once these are known."""
        self._seen = 0

    def add(self, same: Mask, zeros: NDArray[np.int64], start: int) -> None:
        """Take in the mask of repeats of the previous sample, (channels, n), their number by channel, and their
        start.
        """
        if not same.shape[1]:
            return
        self.repeats += zeros
        self._seen += same.shape[1]
        part: Array | None = None
        has_run, trailing = _has_run(same, zeros), _trailing(same)
        for group in self._groups:
            rows = list(group.rows)
            if not group.open and not has_run[rows].all():
                group.open = int(trailing[rows].min())
                continue
            together = same[rows[0]] if len(rows) == 1 else np.logical_and.reduce(same[rows])
            part = self._usual(same) if part is None else part
            self._runs(group, together, start, part, same)
        if part is None and np.isnan(self._part).any():
            self._usual(same)

    def finish(self, able: NDArray[np.bool_]) -> list[Group]:
        """Every group with the runs that are its own, beyond chance against the whole recording.

        `able` (channels,): those that are evidence alone or as a triad. A counter that gives single pulses is not:
        how regularly they come depends on where its input stands between two pulses.
        """
        for group in self._groups:
            if group.open:
                part = np.where(np.isnan(self._part), LEAST_PART, self._part)
                self._keep(group, self._seen - group.open, group.open, part, None, shift=1)
        larger: list[Run] = []
        several = len(self.repeats) > 1
        for group in self._groups:
            inside = sum(run.length for run in group.runs)
            whole = (self.repeats - inside) / max(self._seen - inside, 1)
            if several and len(group.rows) < len(self.repeats) and not able[list(group.rows)].all():
                group.runs = []
                continue
            shortest = self._shortest(group, whole)
            own = [run for run in group.runs if run.length >= shortest]
            group.runs = [run for run in own if not _within(run, larger)]
            larger += group.runs
            self.inside[list(group.rows)] += sum(run.length for run in group.runs)
        return self._groups

    def _usual(self, same: Mask) -> Array:
        """Usual share of repeats of each channel in a window of this piece, (channels,), without windows that repeat
        throughout, which are to be judged. Where there is no other window, the share of the previous piece is used.
        """
        width = WINDOW if same.shape[1] >= 2 * WINDOW else same.shape[1]
        windows = same.shape[1] // width
        whole = same[:, : windows * width].reshape(len(same), windows, width)
        # Bytes are summed, not converted; fewer than 2·WINDOW repeats fit into one.
        counts = np.sort(np.add.reduce(whole.view(np.uint8), axis=2, dtype=np.uint8), axis=1)
        moving = np.count_nonzero(counts < width, axis=1).tolist()
        for c, number in enumerate(moving):
            if number and (windows > 1 or np.isnan(self._part[c])):
                self._part[c] = _quantile(counts[c, :number], USUAL) / width
        return np.where(np.isnan(self._part), LEAST_PART, self._part)

    def _runs(self, group: Group, rows: Mask, start: int, part: Array, same: Mask) -> None:
        carried, group.open = group.open, 0
        if rows.all():
            group.open = carried + len(rows)
            return
        first, group.open = int(np.argmin(rows)), int(np.argmin(rows[::-1]))
        if carried + first >= SHORTEST:
            self._keep(group, start - carried, carried + first, part, _around(same, rows, 0, first))
        inner = rows[first : len(rows) - group.open]
        shortest = self._shortest(group, part)
        if not _has_run_of(inner, shortest):
            return
        edges = np.flatnonzero(inner[1:] != inner[:-1]) + 1
        begins, ends = edges[::2], edges[1::2]
        for i in np.flatnonzero(ends - begins >= shortest).tolist():
            begin, end = first + int(begins[i]), first + int(ends[i])
            self._keep(group, start + begin, end - begin, part, _around(same, rows, begin, end))

    def _keep(self, group: Group, first: int, length: int, part: Array, around: Around | None, shift: int = 0) -> None:
        if around is not None:
            part = np.maximum(part, around.parts)
        if length < self._shortest(group, part, around.together if around is not None else 0.0):
            return
        if len(group.runs) < KEPT:
            group.runs.append(Run(first + shift, length))
        else:
            group.lost += 1

    def _shortest(self, group: Group, part: Array, together: float = 0.0) -> float:
        """Least length of a run that is beyond chance, `SHORTEST` at least; infinite where there is no evidence.

        ``N·p^L < CHANCE``, solved for L, where p is the product of the shares of the channels that count as evidence,
        or the share `together` in which all of them repeat at once, if it is greater: noise that the channels have in
        common moves them together.
        """
        p = part[list(group.rows)]
        witnesses = p[p < BUSY]
        if not len(witnesses) or (len(group.rows) > 1 and len(witnesses) < 2):
            return np.inf
        each = float(np.sum(np.log(np.maximum(witnesses, LEAST_PART))))
        each = max(each, float(np.log(together))) if together > 0.0 else each
        return max(float(SHORTEST), np.floor((np.log(CHANCE) - np.log(max(self._seen, 1))) / each) + 1.0)


def _quantile(ascending: NDArray[np.uint8], share: float) -> float:
    """The quantile of some ascending numbers, (n,), interpolated linearly between two of them."""
    at = share * (len(ascending) - 1)
    below = int(at)
    low, high = int(ascending[below]), int(ascending[min(below + 1, len(ascending) - 1)])
    return low + (high - low) * (at - below)


def _around(same: Mask, rows: Mask, begin: int, end: int) -> Around | None:
    """Shares of repeats outside a run; None where the piece has too few samples there."""
    before, after = slice(max(begin - NEAR, 0), begin), slice(end, end + NEAR)
    beside = np.hstack([same[:, before], same[:, after]])
    if beside.shape[1] < NEAR:
        return None
    return Around(beside.mean(axis=1), float(np.concatenate([rows[before], rows[after]]).mean()))


def _has_run(same: Mask, zeros: NDArray[np.int64]) -> NDArray[np.bool_]:
    """Mask of the channels, (channels,), with `SHORTEST` consecutive repeats."""
    if same.shape[1] < SHORTEST or not np.any(zeros >= SHORTEST):
        return zeros >= min(SHORTEST, same.shape[1])
    return _has_run_of(same, SHORTEST)


def _has_run_of(same: Mask, length: float) -> NDArray[np.bool_]:
    """Mask of the rows, (…, n), with `length` consecutive repeats, found by doubling: a few passes over bytes."""
    if length > same.shape[-1]:
        return np.zeros(same.shape[:-1], np.bool_)
    needed, spanned = int(np.ceil(length)), 1
    while spanned < needed:
        step = min(spanned, needed - spanned)
        same = same[..., step:] & same[..., :-step]
        spanned += step
    return np.asarray(same.any(axis=-1))


def _trailing(same: Mask) -> NDArray[np.int64]:
    """Repeats at the very end, at most `SHORTEST`, (channels,); those of a group are the fewest of its channels."""
    tail = same[:, -SHORTEST:]
    return np.where(tail.all(axis=1), tail.shape[1], np.argmin(tail[:, ::-1], axis=1)).astype(np.int64)


def _within(run: Run, larger: Sequence[Run]) -> bool:
    stop = run.first_index + run.length
    shared = sum(max(0, min(stop, o.first_index + o.length) - max(run.first_index, o.first_index)) for o in larger)
    return shared > SAME * run.length
