"""Gyros alone, turned by half turns about the vertical: bias and the Earth's horizontal rate, without accelerometers.

Turns about one axis do not determine a matrix of scale factors and misalignments (rank 5 of 9): none is given.
"""

from dataclasses import dataclass, replace
from typing import Literal

import numpy as np
from pydantic import Field

from procedures.analysis.calibration.station_means import station_means
from procedures.analysis.fitness.watched import Inspection
from procedures.analysis.turns.half_turns import HalfTurns, half_turns, level_rate
from procedures.core import units
from procedures.core.errors import BadParameter, UnfitRecording
from procedures.core.limits import Check, Limit, check, verdict
from procedures.core.recording import AXES, GYRO, Recording
from procedures.core.report import Report, Table
from procedures.core.unit import Unit
from procedures.parameters import largest
from procedures.procedure import STATIONS, Evidence, Method, Outcome, RecordedParameters

CONFIDENCE = 0.999
"""Confidence of the interval in which the rate must agree with the latitude's: fails by chance once in a thousand."""
WANDERS = 2.0
"""Scatter of the pairs over that of the noise within the dwells, beyond which the bias wanders."""


class Params(RecordedParameters):
    """Headings of the unit, site and limits."""

    up: Literal["x", "y", "z"] = Field("y", description="axis of the unit that points upwards; it is turned about it")
    turned: tuple[bool, ...] | None = Field(
        None,
        min_length=6,
        max_length=500,
        description="whether each recording is half a turn on; None: every second one",
    )
    latitude_deg: float | None = Field(
        None, ge=-90.0, le=90.0, description="the rate is held against Ω·cos φ; None: it is only given"
    )
    earth_rate_rad_s: float = Field(units.EARTH_RATE, ge=7.0e-5, le=7.6e-5)
    relative_sd_max: float = Field(
        0.1, gt=0.0, le=10.0, description="limit of the horizontal rate's uncertainty (ours)"
    )


@dataclass(frozen=True)
class GyroChannel:
    """Result of one gyro [rad/s]: half difference, half sum, and their uncertainties."""

    channel: str
    horizontal: bool
    """True for the two gyros whose axes are horizontal."""
    half_difference: float
    """Component of the Earth's rate along the channel at the unturned heading."""
    standard_uncertainty: float
    """Standard uncertainty from the scatter of the pairs."""
    lower: float
    """Lower end of the interval of 95 %, with Student's factor for the number of pairs."""
    upper: float
    """Upper end of the interval of 95 %, with Student's factor for the number of pairs."""
    within_sd: float
    """Standard uncertainty expected from the noise within the recordings alone."""
    half_sum: float
    """Bias of the channel; that of the vertical one includes the Earth's vertical rate, where no latitude is given."""
    half_sum_sd: float
    """Standard uncertainty of the half sum, from the scatter of the pairs."""


class Result(Outcome):
    """Results of three channels and the rate that the two horizontal ones measure together."""

    channels: tuple[GyroChannel, ...]
    pairs: int
    horizontal_rate_rad_s: float
    """Horizontal part of the Earth's rate, from the two horizontal gyros."""
    horizontal_rate_sd_rad_s: float
    expected_rad_s: float | None


def analyse(evidence: Evidence, params: Params, unit: Unit | None) -> Result:
    """Return the results of three gyros from one recording a heading, in order. Raises `UnfitRecording`,
    `MissingChannel`, `BadParameter`.
    """
    means = station_means(evidence.recordings, "gyro")
    if means.output_unit != "rad/s":
        raise UnfitRecording(f"the gyro channels are in {means.output_unit}: give their scale, to rad/s")
    found = half_turns(means.outputs, means.mean_sd, _turned(evidence.recordings, params))
    level = [c for c, axis in enumerate(AXES) if axis != params.up]
    (h1, h2), (s1, s2) = found.half_difference[level].tolist(), found.half_difference_sd[level].tolist()
    rate, sd = level_rate(h1, h2, s1, s2)
    expected = None
    if params.latitude_deg is not None:
        expected = params.earth_rate_rad_s * float(np.cos(params.latitude_deg * units.DEG))
    checks = _checks(rate, sd, expected, found, params)
    return Result(
        checks=checks,
        verdict=verdict(checks),
        warnings=_warnings(found, level),
        channels=tuple(_channel(c, found, params) for c in range(3)),
        pairs=found.pairs,
        horizontal_rate_rad_s=rate,
        horizontal_rate_sd_rad_s=sd,
        expected_rad_s=expected,
    )


def report(result: Result) -> Report:
    """Return the report with a row a channel, and the rate."""
    unit, size = units.DISPLAY["rad/s"]
    columns = ("gyro", "unit", "half difference", "±", "± by noise within", "half sum", "±")
    rows = tuple(
        (
            *(c.channel, unit, c.half_difference / size, c.standard_uncertainty / size, c.within_sd / size),
            *(c.half_sum / size, c.half_sum_sd / size),
        )
        for c in result.channels
    )
    rate, sd = result.horizontal_rate_rad_s / size, result.horizontal_rate_sd_rad_s / size
    note = f"{result.pairs} pairs; horizontal rate {rate:.5g} ± {sd:.2g} {unit}"
    if result.expected_rad_s is not None:
        note += f", by the latitude {result.expected_rad_s / size:.5g}"
    return Report(note, (Table("Half turns about the vertical", columns, rows, "± one standard uncertainty."),))


def _turned(recordings: tuple[Recording, ...], params: Params) -> np.ndarray:
    if params.turned is None:
        return np.arange(len(recordings)) % 2 == 1
    if len(params.turned) != len(recordings):
        raise BadParameter("turned", len(params.turned), f"one for each of the {len(recordings)} recordings")
    return np.array(params.turned, dtype=np.bool_)


def _channel(c: int, found: HalfTurns, params: Params) -> GyroChannel:
    half, sd = float(found.half_difference[c]), float(found.half_difference_sd[c])
    reach = found.coverage_factor(0.95) * sd
    vertical = AXES[c] == params.up
    earth = 0.0
    if vertical and params.latitude_deg is not None:
        earth = params.earth_rate_rad_s * float(np.sin(params.latitude_deg * units.DEG))
    return GyroChannel(
        f"gyro_{AXES[c]}",
        not vertical,
        half,
        sd,
        half - reach,
        half + reach,
        float(found.within_sd[c]),
        float(found.bias[c]) - earth,
        float(found.bias_sd[c]),
    )


def _checks(rate: float, sd: float, expected: float | None, found: HalfTurns, params: Params) -> tuple[Check, ...]:
    relative = sd / rate if rate > 0.0 else float("inf")
    limit = largest(params, "relative_sd_max", "1")
    checks = [check("horizontal rate, relative standard uncertainty", relative, limit)]
    if expected is not None:
        reach = found.coverage_factor(CONFIDENCE) * sd
        bound = Limit("rad/s", reach, -reach, source=f"{100 * CONFIDENCE:g} % interval")
        checks.append(check("horizontal rate − Ω·cos φ", rate - expected, bound, sd))
    return tuple(checks)


def _warnings(found: HalfTurns, level: list[int]) -> tuple[str, ...]:
    wandering: list[str] = []
    for c in level:
        seen, within = float(found.half_difference_sd[c]), float(found.within_sd[c])
        if seen > WANDERS * within > 0.0:
            wandering.append(
                f"gyro_{AXES[c]}: the pairs scatter {seen / within:.2g} times as much as the noise within the "
                "recordings explains: the bias wanders between them, which is in the uncertainty"
            )
    return (*wandering, "turns about one axis do not determine scale factors and misalignments: none are given")


def inspection(_params: Params, _count: int) -> Inspection:
    """Return the settings of the inspection: headings at rest against each other, the gyros alone."""
    return replace(STATIONS, channels=GYRO)


METHOD = Method(
    "gyro_half_turns",
    "Gyros alone, by half turns",
    "1.0.0",
    Params,
    Result,
    analyse,
    report,
    inspection=inspection,
)
