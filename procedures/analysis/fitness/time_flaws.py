"""Findings on the course of a recording: outliers, steps, changes of the noise, runs and copies of samples."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from procedures.analysis.fitness.changes import Change, changes
from procedures.analysis.fitness.findings import Finding, FitnessSettings, Kind, Severity
from procedures.analysis.fitness.jumps import SIGMAS, WHITE, Jump
from procedures.analysis.fitness.levels import CellLevels
from procedures.analysis.fitness.stalls import Group
from procedures.analysis.fitness.wording import Wording, amount
from procedures.core.arrays import Array
from procedures.core.recording import Channel

SHORT_RUN = 10
"""Run of repeated rows from which on the data link was hung; a shorter one is a glitch."""
SHORT_SHARE = 1e-3
"""Share of a channel's samples that may stand still before the channel is refused."""
LEAST_CHANGE = float(np.log(1.4))
"""Least change of the noise, in the logarithm; temperature and a level's place between two counts change it less."""
NOISE_SPREADS = 6.0
"""Least change of the noise in spreads, in addition to `LEAST_CHANGE`."""
LEAST_NOISE = 0.5
"""Least noise, in resolutions, for which small steps of the level are more than rounding."""
FINE_NOISE = 1.0
"""Least noise, in resolutions, for which its changes are more than rounding."""
LEAST_STEP = 0.01
"""Least height of any step, in resolutions."""
ROUNDING = 2.0
"""Least height of a step, in resolutions, where the noise is smaller."""


def steps_and_noise(cells: CellLevels, resolution: Array) -> tuple[list[list[Change]], list[list[Change]]]:
    """Return steps of the level (cells, raw) and of the noise (groups of cells, in the logarithm), channel by
    channel.
    """
    noise = cells.noise / WHITE
    usual = np.median(noise, axis=1) if noise.shape[1] else np.zeros(len(noise))
    fine = usual > LEAST_NOISE * resolution
    floor = np.where(fine, 0.0, ROUNDING * resolution)
    usual = np.where(usual > 0.0, usual, 1.0)
    least = np.maximum(noise, 1e-3 * usual[:, None])
    of_noise = changes(np.log(least), np.full(len(noise), LEAST_CHANGE), flat=True, least=NOISE_SPREADS)
    uneven = np.repeat(np.maximum(least / usual[:, None], 1.0), cells.group, 1)
    short = cells.means.shape[1] - uneven.shape[1]
    uneven = np.hstack([uneven, np.ones((len(uneven), short))]) if short > 0 else uneven
    floor = np.maximum(floor, LEAST_STEP * resolution)
    of_level = changes(cells.means, floor, uneven)
    # Means are twice as certain as lines where there is no drift; they would only repeat what lines detected.
    floor = np.where(usual > FINE_NOISE * resolution, floor, ROUNDING * resolution)
    floor = np.where([bool(f) for f in of_level], np.inf, floor)
    quiet = changes(cells.means, floor, uneven, flat=True)
    of_level = [lines or means for lines, means in zip(of_level, quiet, strict=True)]
    finer = (usual > FINE_NOISE * resolution).tolist()
    return of_level, [found if is_fine else [] for found, is_fine in zip(of_noise, finer, strict=True)]


def outliers(channel: Channel, jumps: Sequence[Jump], count: int, mended: bool, words: Wording) -> list[Finding]:
    """Return findings on single samples far from both neighbours; `mended`: the results are computed without them."""
    if not jumps:
        return []
    first = jumps[0]
    places = words.places([j.index for j in jumps], count - len(jumps))
    where = f"the first is sample {words.at(first.index)}"
    told = (
        f"channel {channel.name}: {words.share(count)} far from both neighbours; {where}, "
        f"{amount(channel, words.rate_hz, first.size)} away where {SIGMAS:g} times the noise of "
        f"{amount(channel, words.rate_hz, first.noise)} was allowed" + (f"; samples {places}" if count > 1 else "")
    )
    them, its = ("them", "their two neighbours stand") if count > 1 else ("it", "its two neighbours stands")
    told += f"; the figures are without {them}, the mean of {its} in" if mended else f"; the figures include {them}"
    return [Finding(Kind.OUTLIER, Severity.WARN, told, first.index, count)]


def steps(
    channel: Channel, sharp: Sequence[Jump], gradual: Sequence[Change], size: int, words: Wording
) -> list[Finding]:
    """Return findings on shifts of the level: those visible in one sample, and those in means of cells of `size`
    samples.
    """
    places = [(j.index, j.size, "sample") for j in sharp]
    for change in gradual:
        index = change.index * size
        if all(abs(index - known) > 3 * size for known, _, _ in places):
            places.append((index, change.height, "about sample" if size > 1 else "sample"))
    if not places:
        return []
    places.sort()
    shown = "; ".join(
        f"by {amount(channel, words.rate_hz, height)} at {where} {words.at(index)}"
        for index, height, where in places[:5]
    )
    more = f"; and {len(places) - 5} more" if len(places) > 5 else ""
    times = "once" if len(places) == 1 else f"{len(places)} times"
    told = f"channel {channel.name}: the level steps {times}: {shown}{more}"
    return [Finding(Kind.STEP, Severity.WARN, told, places[0][0], len(places))]


def noise_changes(channel: Channel, found: Sequence[Change], size: int, words: Wording) -> list[Finding]:
    """Return findings on changes of the noise; `size`: samples behind one value of it."""
    if not found:
        return []
    shown = "; ".join(
        f"to {np.exp(c.height):.3g} times what it was at about sample {words.at(c.index * size)}" for c in found[:5]
    )
    more = f"; and {len(found) - 5} more" if len(found) > 5 else ""
    told = f"channel {channel.name}: the noise changes: {shown}{more}"
    return [Finding(Kind.NOISE_CHANGE, Severity.WARN, told, found[0].index * size, len(found))]


def hung(group: Group, words: Wording) -> Finding:
    """Return the finding on rows that repeat in a run."""
    longest = max(group.runs, key=lambda run: run.length)
    told = (
        f"{longest.length} rows in a row repeat the one before exactly, from sample {words.at(longest.first_index)}: "
        "the data link seems to have stalled"
    )
    count, total = len(group.runs) + group.lost, sum(run.length for run in group.runs)
    if count > 1:
        told += f"; {count} such runs, {words.share(total)} in all, from samples {_places(group, words)}"
    severity = Severity.REFUSE if longest.length >= SHORT_RUN else Severity.WARN
    return Finding(Kind.REPEATED, severity, told, longest.first_index, longest.length, of_row=True)


def stands_still(group: Group, names: Sequence[str], words: Wording) -> Finding:
    """Return the finding on one channel or triad that repeats in runs while others move."""
    longest = max(group.runs, key=lambda run: run.length)
    total, count = sum(run.length for run in group.runs), len(group.runs) + group.lost
    times = "once" if count == 1 else f"{count} times"
    told = (
        f"{_called(names)} still {times} while others move, {words.share(total)} in all: the longest "
        f"{longest.length} samples ({longest.length / words.rate_hz:.4g} s) from sample {words.at(longest.first_index)}"
    )
    if count > 1:
        told += f"; from samples {_places(group, words)}"
    severity = Severity.REFUSE if total > SHORT_SHARE * words.seen else Severity.WARN
    return Finding(Kind.STANDS_STILL, severity, told, longest.first_index, total)


def alike(columns: Sequence[int], channels: Sequence[Channel], repeats: NDArray[np.int64]) -> list[list[int]]:
    """Return copied channels by sensor: those of one quantity that repeat about as often; `repeats` (channels,)."""
    groups: list[list[int]] = []
    for c in columns:
        near = [g for g in groups if channels[g[0]].quantity is channels[c].quantity]
        near = [g for g in near if abs(repeats[g[0]] - repeats[c]) < 0.05 * repeats[c]]
        if near:
            near[0].append(c)
        else:
            groups.append([c])
    return groups


def copied(
    names: Sequence[str],
    repeats: int,
    alone: bool,
    value: float | None,
    words: Wording,
    settings: FitnessSettings,
) -> Finding:
    """Return the finding on copied channels; `alone`: no other channel moves meanwhile; `value`: that at which nearly
    all repeats stand, None where they stand at many.
    """
    rate = words.rate_hz * (1.0 - repeats / max(words.seen - 1, 1))
    who = f"channel {names[0]}" if len(names) == 1 else f"channels {names[0]} … {names[-1]}"
    begin = f"{who}: {words.share(repeats)} repeat the one before exactly"
    severity = Severity.WARN if settings.means_only or not alone else Severity.REFUSE
    if value is not None:
        told = (
            f"{begin}, nearly all of them at {value:.6g}: a dead band or a threshold cuts small changes off, and the "
            "noise below it is not in the data; record without it"
        )
        return Finding(Kind.REPEATED if alone else Kind.COPIED, severity, told, 0, repeats)
    if alone:
        told = (
            f"{begin}: rows seem to be sent more than once, as if the true rate were {rate:.4g} Hz, or a filter, such "
            "as a median, holds values; record the sensor's own samples at its own rate"
        )
        return Finding(Kind.REPEATED, severity, told, 0, repeats)
    told = (
        f"{begin} while others move: sampled at about {rate:.4g} Hz and filled up to {words.rate_hz:g} Hz by copying; "
        "what is faster than that is not of the sensor"
    )
    return Finding(Kind.COPIED, Severity.WARN, told, 0, repeats)


def _places(group: Group, words: Wording) -> str:
    return words.places([run.first_index for run in group.runs], group.lost)


def _called(names: Sequence[str]) -> str:
    return f"channel {names[0]} stands" if len(names) == 1 else f"channels {names[0]} … {names[-1]} together stand"
