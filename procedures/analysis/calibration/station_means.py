"""Reduces one recording a station to one mean output a channel, with its scatter as observed within the dwell."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from procedures.analysis.calibration.slow_noise import slow_excess
from procedures.core.arrays import Array
from procedures.core.errors import UnfitRecording
from procedures.core.imu_model import TriadCalibration
from procedures.core.recording import (
    INCREMENTS,
    TRIADS,
    NominalScale,
    Recording,
    RecordingInfo,
    require_complete,
    require_finite,
)
from procedures.core.table_angles import TableAngles

BATCHES = 20
"""Stretches a dwell is cut into; the scatter of their means allows for noise correlated over less than a stretch."""

RANGE_ENDS = tuple(float(2**bits - over) for bits in (15, 31) for over in (0, 1))
"""Full scale of counters of 16 and 32 bits, without the sign."""


@dataclass(frozen=True)
class StationMeans:
    """Mean nominal outputs of one triad at n stations, in the unit of its channels."""

    triad: str
    output_unit: str
    """Unit of the outputs: "rad/s", "m/s^2" or "count"."""
    outputs: Array
    """Mean nominal outputs, shape (n, 3)."""
    scatter_sd: Array
    """Standard deviation of single samples within the dwell, shape (n, 3)."""
    mean_sd: Array
    """Standard uncertainty of the mean from the scatter of batch means within the dwell, shape (n, 3)."""
    slow_excess: Array
    """Excess variance of the mean due to slow noise (`slow_excess`), shape (n, 3)."""
    windows: Array
    """[start, stop] of each dwell since the first one's launch [s], shape (n, 2)."""
    counts: tuple[int, ...]
    labels: tuple[str, ...]
    angles: tuple[TableAngles | None, ...]
    at_reference_c: tuple[float, float] | None = None
    """Readings of case and converter that a thermal correction has brought the outputs to; None: as they were."""


@dataclass(frozen=True)
class _Summary:
    mean: Array
    scatter_sd: Array
    mean_sd: Array
    slow_excess: Array
    frozen_at: tuple[float | None, ...]
    """The raw value of a channel that never changed, else None."""


def station_means(recordings: Sequence[Recording], triad: str) -> StationMeans:
    """Means of a triad's three channels, one row a recording (thesis 3.3.4: expectation over the averaging time).

    Raises `MissingChannel`, and `UnfitRecording` where samples are not finite, where the channels' units differ, or
    where a channel stands still as no live one can (see `_refuse_frozen`).
    """
    if not recordings:
        raise UnfitRecording("there is no recording to take means of")
    infos = [r.info for r in recordings]
    unit = _output_unit(infos, triad)
    summaries = [_summary(r, triad) for r in recordings]
    _refuse_frozen(recordings, summaries, triad)
    return StationMeans(
        triad,
        unit,
        np.array([s.mean for s in summaries]),
        np.array([s.scatter_sd for s in summaries]),
        np.array([s.mean_sd for s in summaries]),
        np.array([s.slow_excess for s in summaries]),
        np.array([[i.start_s, i.start_s + i.duration_s] for i in infos]) - (infos[0].launched_s or 0.0),
        tuple(i.count for i in infos),
        tuple(i.station.label if i.station else i.id for i in infos),
        tuple(i.station.angles if i.station else None for i in infos),
    )


def require_unit_of(calibration: TriadCalibration, means: StationMeans) -> None:
    """Refuse means that are not in the unit that a calibration is for. Raises `UnfitRecording`."""
    if means.output_unit != calibration.output_unit:
        raise UnfitRecording(
            f"the {means.triad} channels are in {means.output_unit}, the calibration is for {calibration.output_unit}"
        )


def launch_warnings(recordings: Sequence[Recording]) -> tuple[str, ...]:
    """Return a warning where the recordings are of several launches of the unit, which an analysis takes for one."""
    launches = {r.info.launched_s for r in recordings if r.info.launched_s is not None}
    if len(launches) < 2:
        return ()
    return (
        f"the recordings come from {len(launches)} launches of the unit: it was switched off in between, and what its "
        "coefficients change from launch to launch is in the result but not in its uncertainties",
    )


def _output_unit(infos: Sequence[RecordingInfo], triad: str) -> str:
    found = {info.channels[info.column(name)].rate_unit for info in infos for name in TRIADS[triad]}
    if len(found) != 1:
        raise UnfitRecording(f"the {triad} channels have different units: {', '.join(sorted(found))}")
    return found.pop()


def _summary(recording: Recording, triad: str) -> _Summary:
    """Sums over batches, block by block, so that a long dwell costs no memory. Values are taken from the first
    sample on.
    """
    info = recording.info
    names = TRIADS[triad]
    columns = [info.column(name) for name in names]
    if info.count < BATCHES:
        raise UnfitRecording(f"recording {info.id}: {info.count} samples are too few, at least {BATCHES} are needed")
    sums, squares = np.zeros((BATCHES, 3)), np.zeros((BATCHES, 3))
    low, high, first = np.full(3, np.inf), np.full(3, -np.inf), None
    seen = 0
    for block in recording.blocks():
        raw = np.asarray(block)[:, columns].astype(np.float64)
        if not len(raw):
            continue
        require_finite(info, names, raw)
        first = raw[0] if first is None else first
        low, high = np.minimum(low, raw.min(axis=0)), np.maximum(high, raw.max(axis=0))
        edges, batches = _batch_edges(seen, len(raw), info.count)
        sums[batches] += np.add.reduceat(raw - first, edges, axis=0)
        squares[batches] += np.add.reduceat((raw - first) ** 2, edges, axis=0)
        seen += len(raw)
    require_complete(info, seen)
    first = np.zeros(3) if first is None else first
    frozen = tuple(float(v) if a == b else None for v, a, b in zip(first, low, high, strict=True))
    return _in_units(info, info.nominal_scale(names), sums, squares, first, frozen)


def _in_units(
    info: RecordingInfo,
    scale: NominalScale,
    sums: Array,
    squares: Array,
    first: Array,
    frozen: tuple[float | None, ...],
) -> _Summary:
    sizes = np.diff(np.ceil(np.arange(BATCHES + 1) * info.count / BATCHES))[:, None]
    mean = sums.sum(axis=0) / info.count
    variance = np.maximum(squares.sum(axis=0) / info.count - mean**2, 0.0) * info.count / (info.count - 1)
    batch_sd = np.std(sums / sizes, axis=0, ddof=1)
    return _Summary(
        scale.rates(first + mean),
        np.sqrt(variance) * np.abs(scale.gain),
        batch_sd / np.sqrt(BATCHES) * np.abs(scale.gain),
        slow_excess(sums / sizes) * scale.gain**2,
        frozen,
    )


def _batch_edges(seen: int, length: int, count: int) -> tuple[list[int], list[int]]:
    """Starts of the batches inside a block that begins at sample `seen`, and the batches' indices."""
    starts = np.ceil(np.arange(BATCHES) * count / BATCHES).astype(int) - seen
    current = int(np.searchsorted(starts, 0, side="right")) - 1
    batches = [current, *(b for b in range(current + 1, BATCHES) if starts[b] < length)]
    return [0, *(int(starts[b]) for b in batches[1:])], batches


def _refuse_frozen(recordings: Sequence[Recording], summaries: Sequence[_Summary], triad: str) -> None:
    """Refuse a frozen channel: dead if it gives the same value at every one of several stations; stuck if it
    stands at a whole number other than zero at some and moves at others.

    A counter proves less than a sample does: across the Earth's rate it gives no pulse for minutes, and a quiet input
    of almost exactly k pulses a sample gives k throughout a dwell, by chance one dwell in as many as it has samples.
    So a counter is stuck only if it stands at the same number twice, or at the end of its range.
    """
    if len(recordings) < 2:
        return
    for c, name in enumerate(TRIADS[triad]):
        values = [s.frozen_at[c] for s in summaries]
        silent = values[0] == 0.0 and len(values) < 4
        if values[0] is not None and not silent and all(v == values[0] for v in values):
            raise UnfitRecording(
                f"channel {name} reads {values[0]:g} throughout all {len(values)} recordings: it is stuck"
            )
        moving = any(v is None for v in values)
        for recording, value in zip(recordings, values, strict=True):
            if moving and value and _is_integer(recording) and _is_stuck(recording.info, name, value, values):
                raise UnfitRecording(f"recording {recording.info.id}: channel {name} is stuck at {value:g}")


def _is_stuck(info: RecordingInfo, name: str, value: float, values: Sequence[float | None]) -> bool:
    counter = info.channels[info.column(name)].quantity in INCREMENTS
    return not counter or abs(value) in RANGE_ENDS or values.count(value) > 1


def _is_integer(recording: Recording) -> bool:
    return any(np.issubdtype(np.asarray(block).dtype, np.integer) for block in recording.blocks())
