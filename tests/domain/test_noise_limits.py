"""Limits of noise: the thesis's are for declared units, and a bound above a limit is no failure."""

import numpy as np
import pytest

from procedures.core.limits import Verdict
from procedures.core.noise import NoiseCoefficients
from procedures.core.recording import Channel, MemoryRecording, Quantity, RecordingInfo
from procedures.core.unit import TriadRecord, Unit
from procedures.core.units import DEG_PER_SQRT_HOUR
from procedures.inspection import analyse_method
from procedures.methods.noise_analysis import METHOD, Params, Result
from procedures.procedure import Evidence

RATE_HZ = 20.0
CHANNELS = (
    Channel("gyro_x", Quantity.ANGULAR_RATE, "rad/s"),
    Channel("accelerometer_x", Quantity.SPECIFIC_FORCE, "m/s^2"),
)
IMPORTED = Unit("MY-1", RATE_HZ, CHANNELS)
"""Record of a unit that only an import has made known."""
QUIET = TriadRecord((NoiseCoefficients(0.0, 1e-6),) * 3)


def analysed(unit: Unit | None, walk_deg_sqrt_h: float = 0.5, **limits: float) -> Result:
    """Ten minutes of white noise by both channels, of which the gyro's random walk is given."""
    size = np.array([walk_deg_sqrt_h * DEG_PER_SQRT_HOUR, 1e-3]) * np.sqrt(RATE_HZ)
    samples = np.random.default_rng(7).normal(size=(12_000, 2)) * size
    recording = MemoryRecording(RecordingInfo("r", "MY-1", CHANNELS, RATE_HZ, len(samples)), samples)
    params = Params.model_validate({"wavelet": "none", "noise_limits": limits})
    return analyse_method(METHOD, Evidence(recordings=(recording,)), params, unit)


@pytest.mark.parametrize("unit", [IMPORTED, None])
def test_a_unit_of_which_nothing_is_declared_is_held_to_no_limit_that_nobody_gave(unit: Unit | None) -> None:
    found = analysed(unit)
    (only,) = found.checks
    assert (only.name, only.passed, found.verdict) == ("noise processes observed", True, Verdict.PASS)
    assert only.note.startswith("gyros and accelerometers are held to no limit")
    assert "gyro_random_walk_deg_sqrt_h 0.003" in only.note
    assert found.warnings == ()


def test_a_given_limit_counts_and_is_the_requests() -> None:
    found = {c.name: c for c in analysed(IMPORTED, gyro_random_walk_deg_sqrt_h=0.6).checks}
    walk = found["gyro_x random walk"]
    assert (walk.passed, walk.limit.maximum, walk.limit.source) == (True, 0.6, "the request")
    assert not any("bias instability" in name for name in found)
    assert "accelerometer_bias_in_run_m_s2" in found["noise processes observed"].note
    failed = analysed(IMPORTED, gyro_random_walk_deg_sqrt_h=0.4)
    assert failed.verdict is Verdict.FAIL


def test_a_declared_unit_is_held_to_the_thesiss_limits_and_the_source_is_said() -> None:
    declared = Unit("SIM", RATE_HZ, CHANNELS, gyro=QUIET, accelerometer=QUIET)
    found = {c.name: c for c in analysed(declared).checks}
    assert {c.limit.source for c in found.values()} == {"thesis 4.3, 5.6"}
    assert set(found) == {"gyro_x random walk", "gyro_x bias instability", "accelerometer_x bias instability"}
    assert not found["gyro_x random walk"].passed  # 0.5 is seen, and above 0.003


def test_a_process_that_was_not_observed_is_inconclusive_above_its_limit() -> None:
    """White noise alone shows no bias instability; ten minutes bound it far above the limit."""
    limits = {
        "gyro_random_walk_deg_sqrt_h": 0.6,
        "gyro_bias_in_run_deg_h": 0.015,
        "accelerometer_bias_in_run_m_s2": 1.0,
    }
    found = analysed(IMPORTED, **limits)
    outcomes = {c.name: c.decision and c.decision.outcome for c in found.checks}
    assert outcomes["gyro_x bias instability"] == "inconclusive"
    assert outcomes["accelerometer_x bias instability"] == "pass"
    assert (found.verdict, found.statement and found.statement.outcome) == (Verdict.ERROR, "inconclusive")
