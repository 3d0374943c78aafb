"""Allan deviation and its relatives of the channels of a recording of any length, with intervals.

Overlapping and non-overlapping Allan, modified Allan, time and Hadamard deviation (NIST SP 1065); 68 % or another
confidence from equivalent degrees of freedom. Samples are taken in nominal units, before any calibration.
"""

from collections.abc import Generator
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Annotated, Literal

import numpy as np
from pydantic import Field

from procedures.analysis.allan.correlated import Uncorrelatable
from procedures.analysis.allan.deviation import Deviation, DeviationStream
from procedures.analysis.allan.statistic import (
    STATISTICS,
    Sizes,
    Statistic,
    log_sizes,
    octave_sizes,
    one_two_four_sizes,
)
from procedures.analysis.fitness.findings import FitnessSettings
from procedures.analysis.fitness.watched import Inspection
from procedures.core import units
from procedures.core.errors import BadParameter, UnfitRecording
from procedures.core.limits import Limit, check, verdict
from procedures.core.recording import INCREMENTS, Quantity, Recording
from procedures.core.report import Figure, Report, Series, Table
from procedures.core.unit import Unit
from procedures.procedure import Evidence, Method, Outcome, RecordedParameters

MOST = 10_000
"""Cluster times that are taken of one recording: a curve of more is no curve to be read."""
Tau = Annotated[float, Field(gt=0.0, le=1e9)]


class Params(RecordedParameters):
    """Statistic, channels and averaging times of the deviation."""

    statistic: Literal["allan", "overlapping_allan", "modified_allan", "time", "hadamard", "overlapping_hadamard"] = (
        "overlapping_allan"
    )
    channels: tuple[str, ...] | None = Field(
        None, min_length=1, max_length=64, description="None: every channel but temperatures"
    )
    points: int = Field(100, ge=5, le=1000, description="cluster times, evenly in the logarithm, at the most")
    taus: (
        Literal["even", "octave", "decade", "all"] | Annotated[tuple[Tau, ...], Field(min_length=1, max_length=MOST)]
    ) = Field(
        "even",
        description="even: `points` of them; octave: 1, 2, 4 … samples; decade: 1, 2, 4, 10, 20, 40 … samples; all: "
        "every whole number of samples; or a list [s], each taken as the nearest whole number of samples",
    )
    confidence: float = Field(0.6827, gt=0.0, lt=1.0, description="of the intervals")
    gaps: Literal["refuse", "leave_out"] = Field(
        "refuse", description="samples that are NaN; leave_out: every term that touches one is left out"
    )


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


class Result(Outcome):
    """Every curve, in the order of recordings and channels."""

    statistic: str
    confidence: float
    curves: tuple[Curve, ...]


def analyse(evidence: Evidence, params: Params, unit: Unit | None) -> Result:
    """Analyse block by block, in constant memory. Raises `MissingChannel`, `UnfitRecording`."""
    if not evidence.recordings:
        raise UnfitRecording("there is no recording to take a deviation of")
    statistic = STATISTICS[params.statistic]
    curves = tuple(c for r in evidence.recordings for c in _curves(r, statistic, params))
    shortest = min(min(c.edf[0] for c in curves), 1e9)
    limit = Limit("1", minimum=1.0, source="an interval needs one degree of freedom")
    checks = (check("equivalent degrees of freedom at the shortest τ, the least", shortest, limit),)
    return Result(
        checks=checks,
        verdict=verdict(checks),
        statistic=params.statistic,
        confidence=params.confidence,
        curves=curves,
    )


def report(result: Result) -> Report:
    """Report with a plot for each curve, and a table with three of its points."""
    name = result.statistic.replace("_", " ")
    figures = tuple(_figure(curve, name, result.confidence) for curve in result.curves)
    rows = tuple(
        (c.channel, c.recording, _shown(c)[0], c.tau_s[k], c.deviation[k] / size, c.lower[k] / size, c.upper[k] / size)
        for c in result.curves
        for size in (_shown(c)[1],)
        for k in (0, len(c.tau_s) // 2, len(c.tau_s) - 1)
    )
    columns = ("channel", "recording", "unit", "τ, s", "deviation", "lower", "upper")
    title = f"{name.capitalize()} deviation, first, middle and last point"
    return Report(sections=(Table(title, columns, rows), *figures))


def _curves(recording: Recording, statistic: Statistic, params: Params) -> tuple[Curve, ...]:
    info = recording.info
    names = params.channels or tuple(c.name for c in info.channels if c.quantity is not Quantity.TEMPERATURE)
    try:
        found = _deviations(recording, names, statistic, params, correlate=True)
    except Uncorrelatable:
        found = _deviations(recording, names, statistic, params, correlate=False)
    return tuple(
        Curve(
            recording=info.id,
            channel=name,
            unit=info.channels[info.column(name)].rate_unit + ("·s" if statistic.is_time else ""),
            tau_s=tuple(d.tau_s.tolist()),
            deviation=tuple(d.deviation.tolist()),
            lower=tuple(d.lower.tolist()),
            upper=tuple(d.upper.tolist()),
            terms=tuple(d.terms.tolist()),
            edf=tuple(d.edf.tolist()),
            noise_exponent=tuple(d.alpha.tolist()),
        )
        for name, d in zip(names, found, strict=True)
    )


def _deviations(
    recording: Recording, names: tuple[str, ...], statistic: Statistic, params: Params, *, correlate: bool
) -> list[Deviation]:
    """Process all channels of a recording in one pass."""
    info = recording.info
    columns = [info.column(name) for name in names]
    channels = [info.channels[c] for c in columns]
    with _naming(info.id):
        sizes = _sizes(params, statistic.largest(info.count), info.rate_hz)
        streams = [
            DeviationStream(
                info.rate_hz,
                info.count,
                statistic,
                sizes=sizes,
                increments=channel.quantity in INCREMENTS,
                confidence=params.confidence,
                gaps="refuse" if params.gaps == "refuse" else "aware",
                correlate=correlate,
            )
            for channel in channels
        ]
    for block in recording.blocks():
        for column, channel, stream in zip(columns, channels, streams, strict=True):
            with _naming(info.id, channel.name):
                stream.add(channel.value(np.asarray(block)[:, column].astype(np.float64)))
    return [_finished(stream, info.id, name) for stream, name in zip(streams, names, strict=True)]


def _sizes(params: Params, largest: int, rate_hz: float) -> Sizes:
    """Cluster sizes requested by the parameters. Raises `BadParameter` naming the times that the recording has."""
    if isinstance(params.taus, tuple):
        for tau_s in params.taus:
            if not 0.5 <= tau_s * rate_hz < largest + 0.5:
                allowed = (
                    f"from {1 / rate_hz:g} s, one sample, to {largest / rate_hz:g} s, the longest of this recording"
                )
                raise BadParameter("taus", tau_s, allowed)
        return np.unique(np.round(np.asarray(params.taus) * rate_hz).astype(np.int64))
    if params.taus == "all" and largest > MOST:
        allowed = (
            f"of {largest} cluster times at most {MOST} are taken: ask for octave, decade, a list or a shorter stretch"
        )
        raise BadParameter("taus", "all", allowed)
    every = {"octave": octave_sizes, "decade": one_two_four_sizes, "all": lambda m: np.arange(1, m + 1, dtype=np.int64)}
    return log_sizes(largest, params.points) if params.taus == "even" else every[params.taus](largest)


def _finished(stream: DeviationStream, recording: str, channel: str) -> Deviation:
    with _naming(recording, channel):
        return stream.finish()


@contextmanager
def _naming(recording: str, channel: str = "") -> Generator[None]:
    """Prefix a refusal with the recording and channel that it concerns."""
    try:
        yield
    except Uncorrelatable:
        raise
    except UnfitRecording as refusal:
        where = f"recording {recording}" + (f": channel {channel}" if channel else "")
        raise UnfitRecording(f"{where}: {refusal}") from refusal


def _shown(curve: Curve) -> tuple[str, float]:
    """Display unit of a curve, and its size in SI."""
    known = {"rad/s": ("deg/h", units.DEG_PER_HOUR), "rad/s·s": ("arcsec", units.ARCSEC)}
    return known.get(curve.unit, (curve.unit, 1.0))


def _figure(curve: Curve, name: str, confidence: float) -> Figure:
    label, size = _shown(curve)
    x, y = curve.tau_s, tuple(d / size for d in curve.deviation)
    low, high = (tuple(v / size for v in side) for side in (curve.lower, curve.upper))
    series = (
        Series(name, x, y, style="line_points"),
        Series(f"{100 * confidence:.0f} % interval, lower", x, low, style="reference"),
        Series("upper", x, high, style="reference"),
    )
    return Figure(f"{curve.channel}, {curve.recording}", "τ, s", f"σ, {label}", series, x_log=True, y_log=True)


def inspection(params: Params, count: int) -> Inspection:
    """Requested channels of each recording by itself."""
    gaps = "refuse" if params.gaps == "refuse" else "aware"
    return Inspection(FitnessSettings(least_samples=1, gaps=gaps), params.channels)


METHOD = Method(
    "allan_deviation",
    "Allan deviation and its relatives",
    "1.0.0",
    Params,
    Result,
    analyse,
    report,
    inspection=inspection,
)
