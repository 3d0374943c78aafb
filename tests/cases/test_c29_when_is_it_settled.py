"""A unit that creeps, overshoots or lags behind the air, seen by sensors of any resolution: when is it soaked?

Truths are closed forms, so the drift at the claimed beginning of a soak is known.
"""

from collections.abc import Callable

import numpy as np
import pytest

from procedures.analysis.thermal.profile_progress import CHECK_S, LegEvidence, ProfileProgress, Standing
from procedures.core.temperature_profile import ProfileLeg, SoakCriterion, TemperatureProfile

TARGET_C, SOAK_S, LONGEST_S = 60.0, 600.0, 36_000.0
Curve = Callable[[np.ndarray], np.ndarray]


def creeping(step_c: float, tau_s: float) -> Curve:
    return lambda t: TARGET_C - step_c * np.exp(-t / tau_s)


def overshooting(t: np.ndarray) -> np.ndarray:
    return TARGET_C - 8.0 * np.exp(-t / 1800.0) * np.cos(2.0 * np.pi * t / 3000.0)


def drift_c_min(curve: Curve, t: np.ndarray) -> np.ndarray:
    return (curve(t + 0.5) - curve(t - 0.5)) * 60.0


def run(readings: np.ndarray, air: np.ndarray, slope_c_min: float) -> tuple[LegEvidence | None, ProfileProgress]:
    """The evidence of a leg's end, or None where it was late."""
    leg = ProfileLeg(TARGET_C, 1.0, SOAK_S, LONGEST_S, 0.0)
    progress = ProfileProgress(TemperatureProfile((leg,), SoakCriterion(slope_c_min)))
    for k, (case, around) in enumerate(zip(readings.tolist(), air.tolist(), strict=True), start=1):
        standing = progress.step(k * CHECK_S, case, case, around)
        if standing is Standing.DONE:
            return progress.evidence[-1], progress
        if standing is Standing.LATE:
            return None, progress
    return None, progress


TIMES = np.arange(1, int(LONGEST_S / CHECK_S) + 1) * CHECK_S


@pytest.mark.parametrize("seed", range(20))
def test_no_resolution_makes_a_drift_vanish(seed: int) -> None:
    """At the claimed beginning and end of a soak the true drift is under the limit, whatever the sensor shows."""
    rng = np.random.default_rng([29, seed])
    curve = creeping(rng.uniform(10.0, 60.0) * rng.choice([-1.0, 1.0]), rng.uniform(600.0, 3600.0))
    q, limit = float(rng.choice([0.0625, 0.25, 0.5, 1.0, 2.0])), float(rng.choice([0.01, 0.03, 0.1]))
    readings = np.round(curve(TIMES) / q + rng.uniform(0.0, 1.0)) * q
    evidence, progress = run(readings, np.full_like(TIMES, TARGET_C), limit)
    if evidence is None:
        assert "reads in steps of" in progress.why_late(TARGET_C)
        return
    assert evidence.soaked_s is not None
    span = np.array([evidence.soaked_s, evidence.ended_s])
    # The line through the window lags its middle by half the window; a creep's drift only falls.
    assert np.all(np.abs(drift_c_min(curve, span)) <= limit)


def test_a_sensor_of_one_kelvin_does_not_settle_between_its_steps() -> None:
    curve = creeping(40.0, 2700.0)
    readings = np.round(curve(TIMES))
    last_step_s = float(TIMES[np.flatnonzero(np.diff(readings))[-1] + 1])
    assert last_step_s == pytest.approx(2700.0 * np.log(40.0 / 0.5), abs=CHECK_S)  # 59.5 °C
    evidence, _ = run(readings, np.full_like(TIMES, TARGET_C), 0.01)
    assert evidence is not None
    assert evidence.soaked_s is not None
    assert evidence.soaked_s >= last_step_s + SOAK_S
    fine, _ = run(curve(TIMES), np.full_like(TIMES, TARGET_C), 0.01)
    assert fine is not None
    assert fine.soaked_s == pytest.approx(2700.0 * np.log(40.0 * 60.0 / 2700.0 / 0.01) + 150.0, abs=30.0)


def test_noise_that_dithers_a_coarse_sensor_is_no_obstacle() -> None:
    rng = np.random.default_rng(29)
    curve = creeping(40.0, 1200.0)
    readings = np.round(curve(TIMES) / 0.5 + rng.normal(0.0, 0.6, len(TIMES))) * 0.5
    evidence, _ = run(readings, np.full_like(TIMES, TARGET_C), 0.1)
    assert evidence is not None


def test_passing_the_set_point_is_not_settling() -> None:
    crossing_s = 750.0
    assert abs(overshooting(np.array([crossing_s]))[0] - TARGET_C) < 1e-9
    evidence, _ = run(np.round(overshooting(TIMES), 3), np.full_like(TIMES, TARGET_C), 0.01)
    assert evidence is not None
    assert evidence.soaked_s is not None
    whole = np.arange(evidence.soaked_s, evidence.ended_s, 10.0)
    # From here on the swing is within 0.15 K, and drifts by hardly more than the limit.
    assert evidence.soaked_s > 7000.0
    assert np.all(np.abs(overshooting(whole) - TARGET_C) < 0.15)
    assert np.all(np.abs(drift_c_min(overshooting, whole)) < 0.012)


def test_the_air_at_its_set_point_is_not_the_unit() -> None:
    air = creeping(35.0, 240.0)(TIMES)
    lagging = creeping(35.0, 2400.0)
    evidence, _ = run(lagging(TIMES), air, 0.01)
    assert evidence is not None
    assert evidence.reached_s is not None
    assert evidence.soaked_s is not None
    assert evidence.reached_s < 1100.0
    assert float(np.abs(drift_c_min(lagging, np.array([evidence.soaked_s])))[0]) <= 0.01
    assert evidence.soaked_s > 10_000.0


def test_a_leg_that_never_soaks_is_late_and_says_why() -> None:
    evidence, progress = run(np.round(creeping(40.0, 36_000.0)(TIMES)), np.full_like(TIMES, TARGET_C), 0.001)
    assert evidence is None
    assert "is not soaked" in progress.why_late(TARGET_C)


@pytest.mark.parametrize("lag_s", [600.0, 1200.0, 1800.0])
def test_a_unit_that_has_only_begun_to_follow_is_not_soaked(lag_s: float) -> None:
    """Seen: 10 °C at 2 °C/min, and a converter behind two lags moved by 0.25 °C while the soak was said to be reached.

    The air is a ramp from −40 to −30 °C; the unit, two equal lags behind it, is the difference of the responses to two
    endless ramps, r(t) = t − 2τ + (t + 2τ)·exp(−t/τ).
    """

    def ramp(t: np.ndarray) -> np.ndarray:
        return np.where(t > 0.0, t - 2.0 * lag_s + (t + 2.0 * lag_s) * np.exp(-np.maximum(t, 0.0) / lag_s), 0.0)

    air = -40.0 + np.minimum(TIMES / 30.0, 10.0)
    unit = -40.0 + (ramp(TIMES) - ramp(TIMES - 300.0)) / 30.0
    leg = ProfileLeg(-30.0, 2.0, 0.0, LONGEST_S)
    progress = ProfileProgress(TemperatureProfile((leg,), SoakCriterion(0.02, 300.0, 1.5)))
    for t, case, around in zip(TIMES.tolist(), unit.tolist(), air.tolist(), strict=True):
        if progress.step(t, case, case, around) is Standing.DONE:
            break
    (evidence,) = progress.evidence
    # Late in the creep the rest is at most the slope times the lags, of which the slower decay is one.
    assert abs(evidence.case_c - -30.0) < 0.02 / 60.0 * (2.0 * lag_s + 300.0)
