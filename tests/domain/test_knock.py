"""A knock within an alignment: found where it happened with its size, and no noise or warming up taken for one."""

import numpy as np
import pytest

from procedures.core.imu_model import TriadCalibration, triad_calibration
from procedures.core.limits import Verdict
from procedures.core.recording import Channel, MemoryRecording, Quantity, RecordingInfo
from procedures.methods.initial_alignment_of_recording import METHOD, Result
from procedures.procedure import DatedCalibration, Evidence

RATE_HZ, G, EARTH = 50.0, 9.81, 7.292115e-5
LATITUDE = np.radians(50.0)
CHANNELS = (
    *(Channel(f"accelerometer_{a}", Quantity.SPECIFIC_FORCE, "m/s^2") for a in "xyz"),
    *(Channel(f"gyro_{a}", Quantity.ANGULAR_RATE, "rad/s") for a in "xyz"),
)


def ideal(triad: str, unit: str, sd: float) -> TriadCalibration:
    coefficients = np.column_stack([np.zeros(3), np.eye(3)]).ravel()
    return triad_calibration(triad, unit, unit, coefficients, np.eye(12) * sd**2)


def parked(rng: np.random.Generator, knock_deg: float, about: str, seconds: float = 200.0, drift: float = 0.0):
    """A navigation-grade unit that rests levelled to north; a knock about an axis at a moment, and that moment [s]."""
    n = int(seconds * RATE_HZ)
    force = np.tile([0.0, G, 0.0], (n, 1)) + rng.normal(0.0, 5e-4, (n, 3))
    rate = np.tile([EARTH * np.cos(LATITUDE), EARTH * np.sin(LATITUDE), 0.0], (n, 1)) + rng.normal(0.0, 2e-6, (n, 3))
    force[:, 0] += drift * np.linspace(-0.5, 0.5, n)
    at, angle = int(n * rng.uniform(0.1, 0.9)), np.radians(knock_deg)
    axis = "xyz".index(about)
    rate[at, axis] += angle * RATE_HZ
    if about == "z":
        force[at:, 0] += G * angle
    if about == "x":
        force[at:, 2] -= G * angle
    info = RecordingInfo("r", "U", CHANNELS, RATE_HZ, n)
    return MemoryRecording(info, np.hstack([force, rate])), at / RATE_HZ


def aligned(recording: MemoryRecording) -> Result:
    triads = (ideal("accelerometer", "m/s^2", 1e-4), ideal("gyro", "rad/s", 1e-8))
    evidence = Evidence((recording,), (DatedCalibration("c", "2026-01-01T00:00:00Z", triads),))
    return METHOD.analyse(evidence, METHOD.params.model_validate({"latitude_deg": 50.0, "gravity_m_s2": G}), None)


@pytest.mark.parametrize("seed", range(20))
def test_a_knock_of_a_hundredth_of_a_degree_fails_and_is_placed(seed: int) -> None:
    rng = np.random.default_rng([10, seed])
    size, about = rng.uniform(0.01, 0.05) * rng.choice([-1.0, 1.0]), str(rng.choice(["x", "y", "z"]))
    recording, at_s = parked(rng, size, about)
    result = aligned(recording)
    (attitude,) = result.attitudes
    assert result.verdict is Verdict.FAIL
    assert attitude.step_deg == pytest.approx(abs(size), rel=0.1)
    assert attitude.step_at_s == pytest.approx(at_s, abs=2.0)
    assert any("it was knocked" in w for w in result.warnings)


@pytest.mark.parametrize("seed", range(10))
def test_rest_and_warming_up_are_no_knock(seed: int) -> None:
    rng = np.random.default_rng([11, seed])
    result = aligned(parked(rng, 0.0, "x", drift=rng.uniform(0.0, 1e-3))[0])
    (attitude,) = result.attitudes
    assert attitude.step_deg == 0.0
    assert attitude.step_visible_deg is not None
    assert attitude.step_visible_deg < 0.01
    assert [c.passed for c in result.checks if "step" in c.name] == [True]


def test_a_recording_too_short_to_look_says_so() -> None:
    result = aligned(parked(np.random.default_rng(12), 0.0, "x", seconds=1.0)[0])
    assert any("too few samples to see" in w for w in result.warnings)
