"""Noise of recordings of a unit at rest, each a launch: what a static run says, of any recording (thesis 3.1, 4.1).

Channels may be angle or velocity increments, rates or specific forces, in SI or in counts.
"""

from procedures.core.limits import Limit, check, verdict
from procedures.core.report import Report
from procedures.core.unit import Unit
from procedures.launches import (
    NoiseParameters,
    NoiseResult,
    analyse_launches,
    longest_averaging_time,
    noise_checks,
    noise_report,
    summary_of,
)
from procedures.procedure import Evidence, Method


class Params(NoiseParameters):
    """How to analyse, and what to hold the noise to."""


class Result(NoiseResult):
    """Noise of the recordings."""


def analyse(evidence: Evidence, params: Params, unit: Unit | None) -> Result:
    """Raises `UnfitRecording`, `MissingChannel`, `BadParameter`."""
    launches = analyse_launches(evidence.recordings, params)
    channels = summary_of(launches)
    checks = noise_checks(channels, params.noise_limits)
    if not checks:  # channels in counts: no limit can be held to them
        seen = float(sum(m.mean is not None for s in channels for m in s.means))
        checks = (check("noise processes observed", seen, Limit("1", minimum=1.0, source="a record has some noise")),)
    return Result(
        checks=checks,
        verdict=verdict(checks),
        launches=launches,
        channels=channels,
        averaging_time_s=longest_averaging_time(channels),
    )


def report(result: Result) -> Report:
    """Tables and plots of every channel."""
    return noise_report(result)


METHOD = Method("noise_analysis", "Noise of recordings at rest", "1.0.0", Params, Result, analyse, report)
