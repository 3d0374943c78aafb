"""A deviation curve of a recording's channel with what belongs to it, and bands of many channels in one pass."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np

from procedures.analysis.allan.band import Band, BandStream
from procedures.analysis.allan.sampled import Sampled, SampledStream
from procedures.analysis.allan.statistic import ALLAN, decade_sizes
from procedures.analysis.launch.density import Density
from procedures.analysis.launch.results import BandCurve
from procedures.core.recording import INCREMENTS, Recording


@dataclass(frozen=True)
class Curve:
    """The deviation of one channel of one recording; all lists go with `tau_s`."""

    recording: str
    channel: str
    unit: str
    """Unit of the deviation: that of the channel's nominal rate, times s for the time deviation."""
    tau_s: tuple[float, ...]
    deviation: tuple[float, ...]
    lower: tuple[float, ...]
    upper: tuple[float, ...]
    terms: tuple[int, ...]
    """Squared differences that were averaged."""
    edf: tuple[float, ...]
    """Equivalent degrees of freedom."""
    noise_exponent: tuple[float, ...]
    """α of the rate's spectral density f^α that the degrees of freedom were taken for."""
    density: Density | None = None
    """Power spectral density of the nominal rate; None where it was not asked for or cannot be computed."""
    band: BandCurve | None = None
    """Least, mean and greatest deviation over the starts; of sampled intervals the deviation and one sigma about it."""


def bands(
    recording: Recording,
    names: Sequence[str],
    kind: Literal["all_starts", "sampled_intervals"],
    step_decades: float,
    intervals: int,
) -> list[BandCurve]:
    """Return the bands of channels in one pass: over all starts, or of sampled intervals. Raises `UnfitRecording`."""
    info = recording.info
    columns = [info.column(name) for name in names]
    channels = [info.channels[c] for c in columns]
    sizes = decade_sizes(ALLAN.largest(info.count), step_decades)
    increments = [c.quantity in INCREMENTS for c in channels]
    streams: list[BandStream] | list[SampledStream] = (
        [BandStream(info.rate_hz, info.count, sizes=sizes, increments=i) for i in increments]
        if kind == "all_starts"
        else [SampledStream(info.rate_hz, info.count, sizes, intervals, increments=i) for i in increments]
    )
    for block in recording.blocks():
        for column, channel, stream in zip(columns, channels, streams, strict=True):
            stream.add(channel.value(np.asarray(block)[:, column].astype(np.float64)))
    return [_band_curve(stream.finish()) for stream in streams]


def _band_curve(found: Band | Sampled) -> BandCurve:
    if isinstance(found, Sampled):
        one = found.deviation, found.standard_uncertainty
        lists = (found.tau_s, one[0] - one[1], one[0], one[0] + one[1])
    else:
        lists = (found.tau_s, found.least, found.mean, found.greatest)
    return BandCurve(*(tuple(v.tolist()) for v in lists))
