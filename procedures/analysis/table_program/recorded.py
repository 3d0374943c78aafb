"""Summary of a program's recordings: dwell by dwell, the mean of every channel with its standard uncertainty."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from procedures.analysis.calibration.station_means import BATCHES
from procedures.analysis.calibration.station_noise import mean_covariance
from procedures.analysis.cells import CellStream, channel_rows
from procedures.core.arrays import Array
from procedures.core.errors import UnfitRecording
from procedures.core.noise import NoiseCoefficients
from procedures.core.recording import Recording, Station, require_complete, require_finite
from procedures.core.unit import Unit


@dataclass(frozen=True)
class ChannelMean:
    """Mean output of one channel over one dwell, in its `unit` (an increment as a rate)."""

    channel: str
    unit: str
    mean: float
    standard_uncertainty: float | None
    """Standard uncertainty; None where neither noise nor scatter is known: fewer samples than batches."""
    from_noise: bool
    """True if it comes from the unit's noise; else from the scatter of batch means, blind to noise slower than them."""


@dataclass(frozen=True)
class DwellRecord:
    """Results of one dwell: position, duration, completeness of its recording, and the channel means."""

    station: int
    label: str
    outer_deg: float
    middle_deg: float
    inner_deg: float
    start_s: float
    samples_planned: int
    samples_recorded: int
    means: tuple[ChannelMean, ...]


def mean_sd(noise: NoiseCoefficients, start_s: float, stop_s: float) -> float:
    """Return the standard uncertainty of a mean over [start, stop] since launch as the channel's output of that launch
    [rate].
    """
    return float(np.sqrt(mean_covariance(noise, [[start_s, stop_s]])[0, 0]))


def dwell_records(recordings: Sequence[Recording], stations: Sequence[Station], unit: Unit) -> tuple[DwellRecord, ...]:
    """Return the records of the dwells, one a station. Raises `UnfitRecording` unless recordings match the stations in
    order.
    """
    told = [r.info.station for r in recordings]
    for i, station in enumerate(stations):
        if i >= len(told) or told[i] is None or told[i] != station:
            held = "none" if i >= len(told) else "one of another place or length"
            raise UnfitRecording(f"dwell {i + 1} of the program ({station.label}) has no recording of its own: {held}")
    if len(told) > len(stations):
        raise UnfitRecording(f"{len(told)} recordings for the program's {len(stations)} dwells")
    return tuple(_record(r, s, unit) for r, s in zip(recordings, stations, strict=True))


def _record(recording: Recording, station: Station, unit: Unit) -> DwellRecord:
    info, a = recording.info, station.angles
    if a is None:
        raise UnfitRecording(f"dwell {station.label}: the table's angles are not known")
    names = tuple(c.name for c in info.channels)
    means, scatter = _means(recording, names)
    found: list[ChannelMean] = []
    for k, channel in enumerate(info.channels):
        noise = unit.channel_noise(channel)
        start = info.since_launch_s
        sd = None if scatter is None else float(scatter[k])
        known = None if noise is None else mean_sd(noise, start, start + info.duration_s)
        found.append(ChannelMean(channel.name, channel.rate_unit, float(means[k]), known or sd, bool(known)))
    planned = round(station.record_s * unit.sample_rate_hz)
    place = (a.outer_deg, a.middle_deg, a.inner_deg)
    return DwellRecord(station.index, station.label, *place, info.start_s, planned, info.count, tuple(found))


def _means(recording: Recording, names: tuple[str, ...]) -> tuple[Array, Array | None]:
    """Means of all samples, and the standard uncertainty that the scatter of batch means gives, each (channels,)."""
    info = recording.info
    batch_s = (info.count // BATCHES) / info.rate_hz
    stream = CellStream(info, names, batch_s) if batch_s > 0.0 else None
    total, seen = np.zeros(len(names)), 0
    for rows in channel_rows(info, names, recording.blocks()):
        require_finite(info, names, rows.T)
        total += rows.sum(axis=1)
        seen += rows.shape[1]
        if stream is not None:
            stream.add(rows)
    require_complete(info, seen)
    if stream is None:
        return total / seen, None
    batches = stream.finish().rates
    return total / seen, batches.std(axis=1, ddof=1) / np.sqrt(batches.shape[1])
