"""Noise of recordings of a unit at rest, each a launch: the analysis of a static run (thesis 3.1, 4.1).

Channels may be angle or velocity increments, rates or specific forces, in SI or in counts.
"""

from procedures.core.report import Report
from procedures.core.unit import Unit
from procedures.launches import LAUNCH, NoiseParameters, NoiseResult, analyse_launches
from procedures.procedure import Evidence, Method, RecordedParameters
from procedures.reports.launch import noise_report


class Params(RecordedParameters, NoiseParameters):
    """Settings of the analysis, and limits of the noise."""


class Result(NoiseResult):
    """Noise of the recordings."""


def analyse(evidence: Evidence, params: Params, unit: Unit | None) -> Result:
    """Return the noise of the recordings, each taken as a launch. Raises `UnfitRecording`, `MissingChannel`,
    `BadParameter`.
    """
    return analyse_launches(Result, evidence.recordings, params, unit)


def report(result: Result) -> Report:
    """Return the report: tables and plots of the noise of every channel."""
    return noise_report(result.launches, result.channels, result.averaging_time_s, result.drawn_launch)


METHOD = Method(
    "noise_analysis",
    "Noise of recordings at rest",
    "1.2.0",
    Params,
    Result,
    analyse,
    report,
    inspection=lambda _params, _count: LAUNCH,
)
