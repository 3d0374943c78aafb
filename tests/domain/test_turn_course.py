"""Whole turns of a table that does not follow its plan: late, with other ramps, braked late and led back."""

from dataclasses import replace

import numpy as np
import pytest

from procedures.analysis.turns import summary
from procedures.bench.description import AxisLimits
from procedures.catalog.scale_factor_whole_turns import PROCEDURE
from procedures.core import units
from procedures.core.noise import NoiseCoefficients
from procedures.core.recording import MemoryRecording, RecordingInfo, Station
from procedures.core.unit import TriadRecord
from procedures.procedure import Context
from tests.kit.forward_model import B_GYRO, K_GYRO, SITE, turn

WHITE = NoiseCoefficients(quantization=0.39 * units.ARCSEC, random_walk=0.0014 * units.DEG_PER_SQRT_HOUR)
RATE_HZ, FINE = 100.0, 20
"""Samples a second, and steps of the motion in a sample."""


def _course(station: Station, late_s: float, over_deg: float, at: np.ndarray) -> np.ndarray:
    """Angle [rad] at times: begins late, ramps linearly, overshoots, and is led back by a quintic in two seconds."""
    whole = station.turn
    assert whole is not None
    sign, reach = np.sign(whole.turns), abs(whole.angle_deg) + over_deg
    t, ramp = np.clip(at - late_s, 0.0, None), whole.ramp_s
    total = reach / whole.rate_deg_s + ramp
    up, down = np.clip(t, 0.0, ramp), np.clip(t - (total - ramp), 0.0, ramp)
    steady = np.clip(t - ramp, 0.0, total - 2 * ramp)
    angle = whole.rate_deg_s * (up**2 / (2 * ramp) + steady + down - down**2 / (2 * ramp))
    s = np.clip((t - total) / 2.0, 0.0, 1.0)
    return units.DEG * sign * (angle - over_deg * s**3 * (10 - 15 * s + 6 * s**2))


def _recorded(station: Station, unit, start_s: float, late_s: float, over_deg: float) -> MemoryRecording:
    """The unit's gyros on that course, matrices multiplied out step by step."""
    assert station.angles is not None
    count = round(station.record_s * RATE_HZ)
    edges = np.arange(count * FINE + 1) / (RATE_HZ * FINE)
    course = _course(station, late_s, over_deg, edges)
    spin = np.diff(course) * RATE_HZ * FINE
    theta = units.DEG * station.angles.outer_deg + 0.5 * (course[1:] + course[:-1])
    inside = turn("z", station.angles.middle_deg) @ turn("x", station.angles.inner_deg)
    latitude, azimuth = np.radians(SITE.latitude_deg), np.radians(SITE.azimuth_deg)
    north, above = SITE.earth_rate_rad_s * np.array([np.cos(latitude), np.sin(latitude)])
    earth = np.array([north * np.cos(azimuth), above, -north * np.sin(azimuth)])
    level = np.column_stack([
        earth[0] * np.cos(theta) - earth[2] * np.sin(theta),
        earth[1] + spin,
        earth[0] * np.sin(theta) + earth[2] * np.cos(theta),
    ])  # fmt: skip
    rates = B_GYRO + level @ inside @ K_GYRO.T
    means = rates.reshape(count, FINE, 3).mean(axis=1)
    info = RecordingInfo(station.label, "S-1", unit.channels[:3], RATE_HZ, count, start_s, station)
    return MemoryRecording(info, means)


@pytest.mark.parametrize("planned", [False, True])
def test_a_table_that_is_braked_late_still_gives_the_matrix(
    planned: bool,
    context: Context,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    if planned:  # as analyses took the course before: by the plan alone
        monkeypatch.setattr(summary, "as_turned", lambda motion, *_: motion)
    params = PROCEDURE.params(rates_deg_s=(20.0, 50.0), turning_s=20.0, rest_s=8.0)
    unit = replace(context.unit, gyro=TriadRecord((WHITE,) * 3), sample_rate_hz=RATE_HZ)
    outer = AxisLimits(-360.0, 360.0, 60.0, 100.0, continuous=True)
    context = Context(unit, replace(context.bench, outer=outer))
    rng = np.random.Generator(np.random.Philox(4))
    made, start_s = [], 10.0
    for station in PROCEDURE.schedule(PROCEDURE.resolve(params, context)):
        late_s, over_deg = rng.uniform(0.0, 0.7), rng.uniform(20.0, 110.0)
        made.append(_recorded(station, context.unit, start_s, late_s, over_deg))
        start_s += station.record_s + 3.0
    found = np.array([
        [PROCEDURE.analyse(made, params, context).gyro.coefficient(f"K{i}{j}").estimate for j in (1, 2, 3)]
        for i in (1, 2, 3)
    ])  # fmt: skip
    error = np.max(np.abs(found - K_GYRO))
    # Earth's turn over a second at a wrong angle is 7e-5 rad of 7 or more turned: some 1e-5 of a cross-coupling. By the
    # recorded course an angle is good to the cross-couplings, 1e-3 of the Earth's rate times some radians: below 1e-7.
    assert (error > 1e-6) if planned else (error < 1e-7)
