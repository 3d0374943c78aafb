"""Checks of a thermal cycle against its limits."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from math import inf

import numpy as np

from procedures.analysis.thermal.cycle.results import GyroNoise, ThermalCycle
from procedures.core import units
from procedures.core.limits import Check, Limit, PlannedCheck, check, significance, upper_bound
from procedures.core.recording import AXES

THESIS, NO_RISE, INDEPENDENT = (
    "thesis 4.3, 5.6",
    "thesis fig. 4.15: no positive slope",
    "thesis table 4.6: no correlation",
)
SOURCES = {"allan_rise": NO_RISE, "level": INDEPENDENT}
"""Sources of the limits by default, by field; of the others `THESIS`."""
THREE_SIGMA, MAGNITUDE = "accelerometer_{} 3σ after correction", "|ĝ| over the cycle, rms about its mean"
RISE, DEPENDENCE = "accelerometer_{} rise of the Allan deviation", "gyro_{} independence of temperature, p-value"
NOISE = {
    1: ("gyro_{} random walk in the cycle", "gyro_random_walk_deg_sqrt_h", "deg/√h", units.DEG_PER_SQRT_HOUR),
    2: ("gyro_{} bias instability in the cycle", "gyro_bias_in_run_deg_h", "deg/h", units.DEG_PER_HOUR),
}
"""Checks of a gyro's noise by its index in Q, N, B: name, limit, and the limit's unit with its size in SI."""


@dataclass(frozen=True)
class CycleLimits:
    """Limits of a thermal cycle, each the largest value allowed."""

    three_sigma_m_s2: float
    magnitude_rms_m_s2: float
    allan_rise: float
    gyro_random_walk_deg_sqrt_h: float
    gyro_bias_in_run_deg_h: float
    level: float
    """Significance level: chance that three sound gyros together fail the temperature test."""
    sources: Mapping[str, str] = field(default_factory=dict[str, str])
    """Source of each limit that is not the default, by field."""

    def source(self, limit: str) -> str:
        """Return the source of the limit in this field."""
        return self.sources.get(limit, SOURCES.get(limit, THESIS))

    def largest(self, limit: str, unit: str) -> Limit:
        """Return the largest value in this field as a limit, with its source."""
        return Limit(unit, maximum=getattr(self, limit), source=self.source(limit))

    @property
    def level_of_gyro(self) -> float:
        """Significance level of the test of one gyro: three gyros, one chance (Bonferroni)."""
        return self.level / len(AXES)


def cycle_checks(cycle: ThermalCycle, limits: CycleLimits, *, correct_gyros: bool = False) -> tuple[Check, ...]:
    """3σ and Allan of each accelerometer, |ĝ|, each gyro's dependence on temperature and noise.

    `correct_gyros`: a gyro that depends is judged by what its correction leaves in runs that this has not seen.
    """
    found: list[Check] = []
    limit = limits.largest("three_sigma_m_s2", "m/s^2")
    for axis, name in enumerate(AXES):
        worst = max(cycle.soaks, key=lambda s: s.after_m_s2[axis])
        note = f"worst soak: {worst.target_c:g} °C"
        found.append(check(THREE_SIGMA.format(name), worst.after_m_s2[axis], limit, note=note))
    worst_g = max(after for _, after in cycle.magnitude_m_s2)
    found.append(check(MAGNITUDE, worst_g, limits.largest("magnitude_rms_m_s2", "m/s^2"), note="worst run"))
    limit = limits.largest("allan_rise", "1")
    for name in AXES:
        steepest = max(curve.rise for curve in cycle.allan if curve.axis == name)
        found.append(check(RISE.format(name), steepest, limit, note="worst run"))
    level, source = limits.level_of_gyro, limits.source("level")
    left = {g.axis: g.p_after for g in cycle.gyros_corrected if correct_gyros and g.p_after is not None}
    for g in cycle.gyros:
        note = f"after correction, in runs that it has not seen; before: {g.p_value:.2g}" if g.axis in left else ""
        value = left.get(g.axis, g.p_value)
        found.append(significance(DEPENDENCE.format(g.axis), value, level, note, source))
    for name in AXES:
        noises = [g for g in cycle.gyro_noise if g.axis == name]
        found += [_noise(of_noise.format(name), noises, process, limits) for process, (of_noise, *_) in NOISE.items()]
    return tuple(found)


def planned_cycle_checks(limits: CycleLimits) -> tuple[PlannedCheck, ...]:
    """Return the checks that a cycle will have. Its uncertainties rest on the temperatures to come and are not
    predicted.
    """
    level = limits.level_of_gyro
    independent = Limit("1", minimum=level, source=limits.source("level"))
    return (
        *_of_axes(THREE_SIGMA, limits.largest("three_sigma_m_s2", "m/s^2")),
        PlannedCheck(MAGNITUDE, limits.largest("magnitude_rms_m_s2", "m/s^2")),
        *_of_axes(RISE, limits.largest("allan_rise", "1")),
        *(PlannedCheck(DEPENDENCE.format(axis), independent, level=level) for axis in AXES),
        *(
            PlannedCheck(name.format(axis), limits.largest(most, unit))
            for axis in AXES
            for name, most, unit, _ in NOISE.values()
        ),
    )


def _of_axes(name: str, limit: Limit) -> list[PlannedCheck]:
    return [PlannedCheck(name.format(axis), limit) for axis in AXES]


def _noise(name: str, noises: list[GyroNoise], process: int, limits: CycleLimits) -> Check:
    """The mean over the runs that show it; where none does, the least that it is known to stay below."""
    _, most, unit, size = NOISE[process]
    limit = limits.largest(most, unit)
    values = [(g.quantization, g.random_walk, g.bias_instability)[process] for g in noises]
    seen = [v for v in values if v is not None]
    if seen:
        return check(name, float(np.mean(seen)) / size, limit, note=f"seen in {len(seen)} of {len(values)} runs")
    bounds = [bound for g in noises if (bound := g.upper_limits[process]) is not None]
    return upper_bound(name, min(bounds, default=inf) / size, limit)
