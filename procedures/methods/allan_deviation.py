"""Allan deviation and its relatives of the channels of a recording of any length, with intervals.

Overlapping and non-overlapping Allan, modified Allan, time and Hadamard deviation (NIST SP 1065); 68 % or another
confidence from equivalent degrees of freedom. Samples are taken in nominal units, before any calibration.
"""

from collections.abc import Generator, Sequence
from contextlib import contextmanager
from dataclasses import replace
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
from procedures.analysis.launch.curves import Curve, bands
from procedures.analysis.launch.density import Density
from procedures.analysis.launch.results import BandCurve
from procedures.analysis.launch.spectrum import densities
from procedures.core.errors import BadParameter, UnfitRecording
from procedures.core.limits import Limit, check, verdict
from procedures.core.recording import AROUND, INCREMENTS, Recording
from procedures.core.report import Report
from procedures.core.unit import Unit
from procedures.procedure import Evidence, Method, Outcome, RecordedParameters
from procedures.reports.allan import deviation_report

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
    confidence: float = Field(0.6827, gt=0.0, lt=1.0, description="confidence level of the intervals")
    density: bool = Field(True, description="the power spectral density with each curve; none for a record too short")
    band: Literal["none", "all_starts", "sampled_intervals"] = Field(
        "none",
        description="all_starts: least, mean and greatest deviation over every start; sampled_intervals: `intervals` "
        "a τ (both paper A)",
    )
    band_step_decades: float = Field(0.02, ge=0.002, le=1.0, description="between the band's τ; paper A: 0.002")
    intervals: int = Field(300, ge=2, le=1_000_000, description="a τ, of sampled_intervals")
    gaps: Literal["refuse", "leave_out"] = Field(
        "refuse", description="samples that are NaN; leave_out: every term that touches one is left out"
    )


class Result(Outcome):
    """Every curve, in the order of recordings and channels."""

    statistic: str
    confidence: float
    curves: tuple[Curve, ...]


def analyse(evidence: Evidence, params: Params, unit: Unit | None) -> Result:
    """Return the deviations of every recording and channel, computed block by block in constant memory. Raises
    `MissingChannel`, `UnfitRecording`.
    """
    if not evidence.recordings:
        raise UnfitRecording("there is no recording to take a deviation of")
    statistic = STATISTICS[params.statistic]
    if params.band != "none" and params.gaps == "leave_out":
        raise BadParameter("band", params.band, "none where gaps are left out: a band needs every sample")
    curves = tuple(c for r in evidence.recordings for c in _curves(r, statistic, params))
    curves, told = with_densities_and_bands(evidence.recordings, curves, params)
    shortest = min(min(c.edf[0] for c in curves), 1e9)
    limit = Limit("1", minimum=1.0, source="an interval needs one degree of freedom")
    checks = (check("equivalent degrees of freedom at the shortest τ, the least", shortest, limit),)
    return Result(
        checks=checks,
        verdict=verdict(checks),
        warnings=told,
        statistic=params.statistic,
        confidence=params.confidence,
        curves=curves,
    )


def report(result: Result) -> Report:
    """Return the report with a plot for each curve and its density, and a table with three of its points."""
    return deviation_report(result.statistic, result.confidence, result.curves)


def _curves(recording: Recording, statistic: Statistic, params: Params) -> tuple[Curve, ...]:
    info = recording.info
    names = params.channels or tuple(c.name for c in info.channels if c.quantity not in AROUND)
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


def with_densities_and_bands(
    recordings: Sequence[Recording], curves: tuple[Curve, ...], params: Params
) -> tuple[tuple[Curve, ...], tuple[str, ...]]:
    """Return the curves with densities and bands, and sentences on what could not be found."""
    told: list[str] = []
    found: list[Curve] = []
    for recording in recordings:
        own = [c for c in curves if c.recording == recording.info.id]
        names = [c.channel for c in own]
        spectra: list[Density | None] = [None] * len(own)
        if params.density and params.gaps == "leave_out":
            told.append("no spectral density where gaps are left out")
        elif params.density:
            spectra = densities(recording, names, params.confidence)
        own_bands: list[BandCurve | None] = [None] * len(own)
        if params.band != "none":
            with _naming(recording.info.id):
                own_bands = [*bands(recording, names, params.band, params.band_step_decades, params.intervals)]
        found += [replace(c, density=s, band=b) for c, s, b in zip(own, spectra, own_bands, strict=True)]
    return tuple(found), tuple(dict.fromkeys(told))


def inspection(params: Params, count: int) -> Inspection:
    """Return the settings of the inspection: the requested channels of each recording by itself."""
    gaps = "refuse" if params.gaps == "refuse" else "aware"
    return Inspection(FitnessSettings(least_samples=1, gaps=gaps), params.channels)


METHOD = Method(
    "allan_deviation",
    "Allan deviation and its relatives",
    "1.2.0",
    Params,
    Result,
    analyse,
    report,
    inspection=inspection,
)
