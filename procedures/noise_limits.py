"""Requirements on the noise of recordings at rest, and the checks that they give, measured and planned.

The thesis's requirements are about its own unit. Where a limit is left open they hold for a unit of whose triad the
record declares something; a unit of which nothing is known is held to no limit that nobody asked for.
"""

from collections.abc import Sequence

from pydantic import Field

from procedures.analysis.launch.prediction import predicted_noise
from procedures.analysis.launch.results import ChannelNoise, LaunchNoise
from procedures.analysis.launch.summary import ChannelSummary
from procedures.core import units
from procedures.core.limits import (
    ASKED,
    Check,
    Limit,
    PlannedCheck,
    asked_limit,
    check,
    significance,
    source_of,
    upper_bound,
)
from procedures.core.recording import TRIADS
from procedures.core.unit import Unit
from procedures.parameters import Parameters

SOURCE = "thesis 4.3, 5.6"
THESIS_LIMITS = {
    "gyro_random_walk_deg_sqrt_h": 0.003,
    "gyro_bias_in_run_deg_h": 0.015,
    "accelerometer_bias_in_run_m_s2": 0.0005,
}
"""Requirements of the thesis on its own unit (4.3, 5.6), by the field of the limit."""


def _where_declared(field: str, triad: str) -> str:
    return f"null: {THESIS_LIMITS[field]:g} ({SOURCE}) where its {triad} are declared, else no check"


class NoiseLimits(Parameters):
    """Requirements on the noise of a unit; null: the thesis's (4.3, 5.6) where the unit's record has the triad."""

    gyro_random_walk_deg_sqrt_h: float | None = Field(
        None,
        gt=0.0,
        le=1e6,
        description=_where_declared("gyro_random_walk_deg_sqrt_h", "gyros"),
    )
    gyro_bias_in_run_deg_h: float | None = Field(
        None,
        gt=0.0,
        le=1e6,
        description=f"bias instability; {_where_declared('gyro_bias_in_run_deg_h', 'gyros')}",
    )
    accelerometer_bias_in_run_m_s2: float | None = Field(
        None,
        gt=0.0,
        le=100.0,
        description=f"bias instability; {_where_declared('accelerometer_bias_in_run_m_s2', 'accelerometers')}",
    )
    readiness_s: float | None = Field(
        None,
        gt=0.0,
        le=1e6,
        description="since the launch, by which a warm-up that was found has ended; null: no check",
    )
    absence_level: float | None = Field(
        None,
        gt=0.0,
        le=0.2,
        description="rate random walk and ramp must be absent; chance that a sound unit fails; null: no check",
    )
    vibration_deg_h: float | None = Field(
        None, gt=0.0, description="vibration of the base by the gyros, rms above 1 Hz; null: no check"
    )
    vibration_m_s2: float | None = Field(
        None, gt=0.0, description="vibration of the base by the accelerometers; null: no check"
    )


LIMITED = (
    ("gyro", "random_walk", "deg/√h", units.DEG_PER_SQRT_HOUR, "gyro_random_walk_deg_sqrt_h"),
    ("gyro", "bias_instability", "deg/h", units.DEG_PER_HOUR, "gyro_bias_in_run_deg_h"),
    ("accelerometer", "bias_instability", "m/s^2", 1.0, "accelerometer_bias_in_run_m_s2"),
)
"""Triad, process, unit of its limit, size of that unit in SI, and the field of the limit."""
TRIAD_OF = {"rad/s": "gyro", "m/s^2": "accelerometer"}
"""Unit of a channel's rate -> its triad; channels in counts are held to no limit."""
READY, READY_S = "thesis table 1.4, 4.1.2", 600.0
ABSENCE, ABSENCE_LEVEL = "thesis 4.1.2: their absence is a sign of quality", 0.001
SLOW = ("rate_random_walk", "rate_ramp")


def launch_checks(
    launches: Sequence[LaunchNoise], channels: Sequence[ChannelSummary], limits: NoiseLimits, unit: Unit | None
) -> tuple[Check, ...]:
    """Checks of the noise and of the surroundings; where a triad is held to no limit, that there is a noise at all.
    `unit`: its declared triads are held to the thesis's limits where no other is given; None: no triad is.
    """
    found = [
        _check(s, process, limit, size)
        for s in channels
        for triad, process, name, size, field in LIMITED
        if TRIAD_OF.get(s.rate_unit) == triad
        and (limit := _limit(limits, field, name, unit is not None and unit.triad(triad) is not None)) is not None
    ]
    note = _held_to_no_limit(channels, limits, unit)
    if note or not found:
        seen = float(sum(m.mean is not None for s in channels for m in s.means))
        least = Limit("1", minimum=1.0, source="every record has some")
        found.append(check("noise processes observed", seen, least, note=note))
    return (*found, *surroundings_checks(launches, channels, limits))


def _held_to_no_limit(channels: Sequence[ChannelSummary], limits: NoiseLimits, unit: Unit | None) -> str:
    """The triads whose noise is held to no limit, as nobody gave one and nothing of them is declared; else empty."""
    open_fields: dict[str, list[str]] = {}
    for triad, *_, field in LIMITED:
        there = any(TRIAD_OF.get(s.rate_unit) == triad for s in channels)
        if there and getattr(limits, field) is None and (unit is None or unit.triad(triad) is None):
            open_fields.setdefault(triad, []).append(f"{field} {THESIS_LIMITS[field]:g}")
    if not open_fields:
        return ""
    of_thesis = ", ".join(text for texts in open_fields.values() for text in texts)
    return (
        f"{' and '.join(f'{triad}s' for triad in open_fields)} are held to no limit: nothing of them is declared. "
        f"noise_limits sets one; the thesis has for its unit {of_thesis}"
    )


def _limit(limits: NoiseLimits, field: str, unit: str, declared: bool) -> Limit | None:
    """The limit that was given, else the thesis's for a declared triad, else None."""
    given: float | None = getattr(limits, field)
    if given is None:
        return Limit(unit, maximum=THESIS_LIMITS[field], source=SOURCE) if declared else None
    return asked_limit(unit, given, THESIS_LIMITS[field], SOURCE)


def noise_checks(limits: NoiseLimits, unit: Unit, duration_s: float, launches: int) -> list[PlannedCheck]:
    """Planned checks of the noise of a unit whose noise is known, from the bounds of its coefficients.

    A coefficient c with standard uncertainty u is a root mean square of ``ν = ½·(c/u)²`` degrees of freedom.
    """
    found: list[PlannedCheck] = []
    for triad, process, name, size, field in LIMITED:
        record = unit.triad(triad)
        limit = _limit(limits, field, name, record is not None)
        if limit is None:
            continue
        for channel, noise in zip(TRIADS[triad], record.observed_noise if record else (), strict=False):
            of_process = [p for p in predicted_noise(channel, noise, duration_s, launches) if p.process == process]
            check_name = f"{channel} {process.replace('_', ' ')}"
            for p in of_process:
                freedom = 0.5 * (p.value / p.standard_uncertainty) ** 2
                found.append(PlannedCheck(check_name, limit, 0.0, freedom, p.value / size))
            if not of_process:
                found.append(PlannedCheck(check_name, limit))
    if limits.absence_level is not None:
        names = [c.name for c in unit.channels if c.rate_unit in ("rad/s", "m/s^2")]
        level = limits.absence_level / (2 * max(1, len(names)))
        limit = Limit("1", minimum=level, source=source_of(limits.absence_level, ABSENCE_LEVEL, ABSENCE))
        found += [PlannedCheck(_absent(name, slow), limit, level=level) for name in names for slow in SLOW]
    return found


def _check(s: ChannelSummary, process: str, limit: Limit, size: float) -> Check:
    """The mean over the launches; of a process that no launch shows, the least that it is known to stay below."""
    found = s.mean(process)
    name = f"{s.channel} {process.replace('_', ' ')}"
    if found.mean is not None:
        return check(name, found.mean / size, limit, None if found.sd is None else found.sd / size)
    bound = min((r.upper_limit for r in found.values if r.upper_limit is not None), default=float("inf"))
    described = all(reading.described for reading in found.values)
    reason = "not observed" if described else "not described by the noise model"
    return upper_bound(name, bound / size, limit, reason)


def _absent(channel: str, process: str) -> str:
    return f"{channel} {process.replace('_', ' ')} absent, p-value"


def surroundings_checks(
    launches: Sequence[LaunchNoise], channels: Sequence[ChannelSummary], limits: NoiseLimits
) -> list[Check]:
    """Readiness, absence of rate random walk and ramp, and base vibration, each where its limit is given."""
    found: list[Check] = []
    for index, s in enumerate(channels):
        of_launches = [launch.channels[index] for launch in launches]
        name, ends = s.channel, [c.warm_up for c in of_launches if c.warm_up is not None]
        if limits.readiness_s is not None and s.rate_unit != "count":
            limit = asked_limit("s", limits.readiness_s, READY_S, READY)
            if ends:
                last = max(ends, key=lambda w: w.end_s)
                note = "" if last.has_ended else "it has not ended within the launch: extrapolated"
                found.append(check(f"{name} readiness time", last.end_s, limit, last.end_sd_s, note))
            else:
                found.append(check(f"{name} readiness time", 0.0, limit, note="no warm-up was found"))
        if limits.absence_level is not None:
            source = source_of(limits.absence_level, ABSENCE_LEVEL, ABSENCE)
            level = limits.absence_level / (2 * len(channels))
            for process in SLOW:
                p_values = [c.coefficient(process).likelihood.p_value for c in of_launches]
                least = min((p for p in p_values if p is not None), default=1.0)
                value = min(1.0, len(p_values) * least)  # Bonferroni: several launches, one chance
                found.append(significance(_absent(name, process), value, level, source=source))
        found += _vibration(name, s.rate_unit, of_launches, limits)
    return found


def _vibration(name: str, rate_unit: str, launches: Sequence[ChannelNoise], limits: NoiseLimits) -> list[Check]:
    maximum = {"rad/s": limits.vibration_deg_h, "m/s^2": limits.vibration_m_s2}.get(rate_unit)
    seen = [c.vibration.vibration for c in launches if c.vibration is not None]
    if maximum is None or not seen:
        return []
    unit, size = ("deg/h", units.DEG_PER_HOUR) if rate_unit == "rad/s" else ("m/s^2", 1.0)
    return [check(f"{name} base vibration, rms", max(seen) / size, Limit(unit, maximum=maximum, source=ASKED))]
