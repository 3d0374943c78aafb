"""Recordings that looked sound to every analysis: sums over another time, repeats, clipping below the rail, degrees."""

from typing import Any

import numpy as np
import pytest

from procedures.core.errors import UnfitRecording
from procedures.core.recording import ACCELEROMETER, GYRO, Channel, MemoryRecording, Quantity, RecordingInfo
from procedures.inspection import analyse_method
from procedures.methods import allan_deviation, discover
from procedures.procedure import Evidence, Outcome

GYROS = tuple(Channel(name, Quantity.ANGULAR_RATE, "rad/s") for name in GYRO)
COUNTS = tuple(Channel(name, Quantity.ANGULAR_RATE, "count") for name in GYRO)
INCREMENTS = (
    *(Channel(name, Quantity.ANGLE_INCREMENT, "rad", 1e-9) for name in GYRO),
    *(Channel(name, Quantity.VELOCITY_INCREMENT, "m/s", 2e-8) for name in ACCELEROMETER),
)


def ask(method: str, samples: np.ndarray, rate_hz: float, channels: tuple[Channel, ...], **parameters: Any) -> Outcome:
    """Answer of a method about one recording, by the way that the service takes."""
    entry = discover()[method]
    recording = MemoryRecording(RecordingInfo("r", "U", channels, rate_hz, len(samples)), samples)
    return analyse_method(entry, Evidence((recording,)), entry.params(**parameters), None)


def increments(rng: np.random.Generator, n: int, rate_hz: float) -> np.ndarray:
    """A unit at rest, z up: g = 9.8035 m/s², whatever the rate that is declared."""
    force = (rng.normal(0.0, 2e-4, (n, 3)) + np.array([0.0, 0.0, 9.8035]) / rate_hz) / 2e-8
    turn = (rng.normal(0.0, 2e-7, (n, 3)) + np.array([3e-5, 0.0, 4.5e-5]) / rate_hz) / 1e-9
    return np.rint(np.hstack([turn, force])).astype(np.int32)


@pytest.mark.parametrize(("true_hz", "said"), [(250.0, "as if the rate were 250 Hz"), (31.25, "31.25 Hz")])
@pytest.mark.parametrize("method", ["noise_analysis", "allan_deviation", "kalman_calibration"])
def test_increments_over_another_time_make_the_rate_doubtful(method: str, true_hz: float, said: str) -> None:
    samples = increments(np.random.default_rng(13), 30_000, true_hz)
    with pytest.raises(UnfitRecording) as refusal:
        ask(method, samples, 125.0, INCREMENTS)
    assert said in str(refusal.value)
    assert "the declared rate, 125 Hz, or the number of samples summed, is wrong" in str(refusal.value)
    assert all(name in str(refusal.value) for name in (*GYRO, *ACCELEROMETER))


def test_a_search_for_scale_factors_is_told_of_the_rate_and_goes_on() -> None:
    rng = np.random.default_rng(113)
    pose = increments(rng, 3000, 250.0)
    recordings = []
    for i, direction in enumerate(
        np.vstack([np.eye(3), -np.eye(3), np.ones((1, 3)), [[1, 1, -1], [1, -1, 1], [-1, 1, 1]]])
    ):
        raw = pose.copy()
        up = 9.8035 * direction / np.linalg.norm(direction) / 250.0 / 2e-8
        raw[:, 3:] = np.rint(up + rng.normal(0.0, 1e4, (len(raw), 3)))
        recordings.append(MemoryRecording(RecordingInfo(f"r{i}", "U", INCREMENTS, 125.0, len(raw)), raw))
    entry = discover()["scalar_calibration"]
    outcome = analyse_method(entry, Evidence(tuple(recordings)), entry.params(gravity_m_s2=9.8035), None)
    (warning,) = (w for w in outcome.warnings if "the declared rate" in w)
    assert "as if the rate were 250 Hz" in warning
    assert "recording r0: " in warning
    assert "in all 10 recordings" in warning


@pytest.mark.parametrize("method", ["noise_analysis", "allan_deviation", "kalman_calibration"])
@pytest.mark.parametrize("channels", [1, 3])
@pytest.mark.parametrize("times", [2, 7])
def test_rows_sent_several_times_are_named_with_the_true_rate(times: int, channels: int, method: str) -> None:
    once = np.random.default_rng(14).normal(0.0, 0.0021, (9000, channels))
    with pytest.raises(UnfitRecording) as refusal:
        ask(method, np.repeat(once, times, axis=0), 140.0, GYROS[:channels])
    assert "rows seem to be sent more than once" in str(refusal.value)
    assert f"as if the true rate were {140.0 / times:.4g} Hz" in str(refusal.value)


def test_a_few_equal_rows_are_named_with_every_place() -> None:
    samples = np.round(np.random.default_rng(141).normal(0.0, 0.003, (50_000, 3)), 4)
    for k in (6001, 21_333, 40_200):
        samples[k : k + 10] = samples[k]
    outcome = ask("allan_deviation", samples, 100.0, GYROS, points=20)
    (warning,) = outcome.warnings
    assert "3 such runs" in warning
    assert all(str(k + 1) in warning for k in (6001, 21_333, 40_200))


@pytest.mark.parametrize("method", ["noise_analysis", "allan_deviation", "kalman_calibration"])
def test_full_scale_below_the_rail_is_found_by_pile_up(method: str) -> None:
    rng = np.random.default_rng(16)
    t = np.arange(40_000) / 800.0
    sine = np.clip(np.rint(30_500 * np.sin(2 * np.pi * 19.0 * t) + rng.normal(0.0, 60.0, 40_000)), -28_571, 28_571)
    noise = np.clip(np.rint(rng.normal(27_800.0, 400.0, 40_000)), -28_571, 28_571)
    samples = np.column_stack([sine, noise, np.rint(rng.normal(0.0, 60.0, 40_000))]).astype(np.int32)
    with pytest.raises(UnfitRecording) as refusal:
        ask(method, samples, 800.0, COUNTS)
    for name, at in (("gyro_x", "28571"), ("gyro_x", "-28571"), ("gyro_y", "28571")):
        assert any(f"channel {name}" in s and f"stand at {at}" in s for s in str(refusal.value).split("; "))
    assert "gyro_z" not in str(refusal.value)


def test_counts_that_pass_the_end_of_sixteen_bits_are_not_saturated() -> None:
    samples = np.rint(np.random.default_rng(161).normal(32_700.0, 180.0, (40_000, 3))).astype(np.int32)
    assert np.any(samples == 32_767)
    assert not ask("allan_deviation", samples, 1000.0, COUNTS, points=20).warnings


def test_degrees_for_radians_are_doubted_though_the_numbers_are_those_of_the_file() -> None:
    rate_hz, walk = 700.0, 0.66 / 60.0
    samples = np.random.default_rng(17).normal(0.25, walk * rate_hz**0.5, (70_000, 1))
    outcome = ask("allan_deviation", samples, rate_hz, GYROS[:1], taus=[1.0])
    assert isinstance(outcome, allan_deviation.Result)
    # 100 s: the deviation at 1 s has about 100 degrees of freedom, 7 %; four of these.
    assert outcome.curves[0].deviation[0] == pytest.approx(walk, rel=0.28)
    (warning,) = outcome.warnings
    assert "times the Earth's rate" in warning
    assert "values in deg/s declared as rad/s look like this" in warning
    deg_h = float(warning.split(" was expected, ")[1].split()[0])
    assert deg_h == pytest.approx(0.25 * 57.29578 * 3600.0, rel=0.02)
