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


def cycle_checks(cycle: ThermalCycle, limits: CycleLimits, *, correct_gyros: bool = False) -> tuple[Check, ...]:
    """3σ and Allan of each accelerometer, |ĝ|, each gyro's dependence on temperature and noise.

    `correct_gyros`: a gyro that depends is judged by what its correction leaves in runs that this has not seen.
    """
    found: list[Check] = []
    for axis, name in enumerate(AXES):
        worst = max(cycle.soaks, key=lambda s: s.after_m_s2[axis])
        found.append(
            check(
                f"accelerometer_{name} 3σ after correction",
                worst.after_m_s2[axis],
                Limit("m/s^2", maximum=limits.three_sigma_m_s2, source=limits.source("three_sigma_m_s2")),
                note=f"worst soak: {worst.target_c:g} °C",
            )
        )
    worst_g = max(after for _, after in cycle.magnitude_m_s2)
    limit = Limit("m/s^2", maximum=limits.magnitude_rms_m_s2, source=limits.source("magnitude_rms_m_s2"))
    found.append(check("|ĝ| over the cycle, rms about its mean", worst_g, limit, note="worst run"))
    for name in AXES:
        steepest = max(curve.rise for curve in cycle.allan if curve.axis == name)
        limit = Limit("1", maximum=limits.allan_rise, source=limits.source("allan_rise"))
        found.append(check(f"accelerometer_{name} rise of the Allan deviation", steepest, limit, note="worst run"))
    # Bonferroni: three gyros, one chance.
    level, source = limits.level / len(AXES), limits.source("level")
    left = {g.axis: g.p_after for g in cycle.gyros_corrected if correct_gyros and g.p_after is not None}
    for g in cycle.gyros:
        note = f"after correction, in runs that it has not seen; before: {g.p_value:.2g}" if g.axis in left else ""
        value = left.get(g.axis, g.p_value)
        found.append(significance(f"gyro_{g.axis} independence of temperature, p-value", value, level, note, source))
    for name in AXES:
        noises = [g for g in cycle.gyro_noise if g.axis == name]
        found.append(_noise(f"gyro_{name} random walk in the cycle", noises, 1, limits))
        found.append(_noise(f"gyro_{name} bias instability in the cycle", noises, 2, limits))
    return tuple(found)


def planned_cycle_checks(limits: CycleLimits) -> tuple[PlannedCheck, ...]:
    """Return the checks that a cycle will have. Its uncertainties rest on the temperatures to come and are not
    predicted.
    """
    force = Limit("m/s^2", maximum=limits.three_sigma_m_s2, source=limits.source("three_sigma_m_s2"))
    rms = Limit("m/s^2", maximum=limits.magnitude_rms_m_s2, source=limits.source("magnitude_rms_m_s2"))
    level = limits.level / len(AXES)
    independent = Limit("1", minimum=level, source=limits.source("level"))
    of_axes = [PlannedCheck(f"accelerometer_{axis} 3σ after correction", force) for axis in AXES]
    gyros = [
        PlannedCheck(f"gyro_{axis} independence of temperature, p-value", independent, level=level) for axis in AXES
    ]
    rise = Limit("1", maximum=limits.allan_rise, source=limits.source("allan_rise"))
    rises = [PlannedCheck(f"accelerometer_{axis} rise of the Allan deviation", rise) for axis in AXES]
    noise = [
        PlannedCheck(f"gyro_{axis} {name} in the cycle", _noise_limit(process, limits))
        for axis in AXES
        for name, process in (("random walk", 1), ("bias instability", 2))
    ]
    return (*of_axes, PlannedCheck("|ĝ| over the cycle, rms about its mean", rms), *rises, *gyros, *noise)


def _noise_limit(process: int, limits: CycleLimits) -> Limit:
    """Limit of random walk (1) or bias instability (2)."""
    unit, of = (("", ""), ("deg/√h", "gyro_random_walk_deg_sqrt_h"), ("deg/h", "gyro_bias_in_run_deg_h"))[process]
    return Limit(unit, maximum=getattr(limits, of), source=limits.source(of))


def _noise(name: str, noises: list[GyroNoise], process: int, limits: CycleLimits) -> Check:
    """The mean over the runs that show it; where none does, the least that it is known to stay below."""
    limit, size = _noise_limit(process, limits), (units.ARCSEC, units.DEG_PER_SQRT_HOUR, units.DEG_PER_HOUR)[process]
    values = [(g.quantization, g.random_walk, g.bias_instability)[process] for g in noises]
    seen = [v for v in values if v is not None]
    if seen:
        return check(name, float(np.mean(seen)) / size, limit, note=f"seen in {len(seen)} of {len(values)} runs")
    bounds = [most for g in noises if (most := g.upper_limits[process]) is not None]
    return upper_bound(name, min(bounds, default=inf) / size, limit)
