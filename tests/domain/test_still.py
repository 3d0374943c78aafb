"""Still stretches of an unlabelled recording."""

import numpy as np
import pytest

from procedures.analysis.calibration.still import Stretch, moving_variance, pose_excess, pose_means, still_stretches
from procedures.core.errors import UnfitRecording
from procedures.core.recording import ACCELEROMETER, Channel, MemoryRecording, Quantity, RecordingInfo
from procedures.methods import scalar_calibration
from procedures.procedure import Evidence


def hand_turned(seed: int = 1) -> tuple[np.ndarray, list[tuple[int, int]]]:
    """30 s still, then five poses of 4 s between turns of 1 s, at 100 Hz; and where the poses truly are."""
    rng, parts, edges = np.random.default_rng(seed), [np.tile([0.0, 9.8, 0.0], (3000, 1))], [(0, 3000)]
    for pose in range(5):
        target = np.array([9.8 * np.sin(pose + 1.0), 9.8 * np.cos(pose + 1.0), 0.3])
        parts.append(np.linspace(parts[-1][-1], target, 100))
        start = edges[-1][1] + 100
        edges.append((start, start + 400))
        parts.append(np.tile(target, (400, 1)))
    samples = np.vstack(parts)
    return samples + 0.02 * rng.normal(size=samples.shape), edges


def test_every_pose_is_found_and_no_turn_is_in_it():
    samples, truth = hand_turned()
    found = still_stretches(samples, 100.0)
    assert len(found) == len(truth)
    for stretch, (start, stop) in zip(found, truth, strict=True):
        assert start <= stretch.start + 5  # a turn's last 50 ms may pass beneath the noise
        assert stretch.stop <= stop + 5
        assert stretch.stop - stretch.start > 0.6 * (stop - start)


def test_the_answer_does_not_depend_on_chance_or_on_the_unit_of_the_samples():
    samples, _ = hand_turned()
    assert still_stretches(samples, 100.0) == still_stretches(samples, 100.0)
    assert still_stretches(samples * 417.0 + 32768.0, 100.0) == still_stretches(samples, 100.0)


def test_moving_variance_is_the_sample_variance_of_its_window():
    samples = np.random.default_rng(2).normal(size=(50, 3)) + 1e4
    variance = moving_variance(samples, 10)
    assert variance[25] == pytest.approx(samples[20:30].var(axis=0, ddof=1), rel=1e-6)
    assert variance[0] == pytest.approx(samples[:5].var(axis=0, ddof=1), rel=1e-6)


def test_pose_means_and_their_uncertainty():
    samples = np.random.default_rng(3).normal(size=(4000, 3))
    means, sd = pose_means(samples, (Stretch(0, 2000), Stretch(2000, 4000)))
    assert means[1] == pytest.approx(samples[2000:].mean(axis=0))
    # Ten parts: relative error 1/√18 = 24 % each, six of them; four standard deviations.
    assert sd == pytest.approx(np.full((2, 3), 1 / np.sqrt(2000)), rel=0.95)


def test_a_recording_without_its_still_beginning_is_refused():
    with pytest.raises(UnfitRecording, match="too short"):
        still_stretches(np.zeros((1500, 3)), 100.0)


def test_short_poses_show_no_slow_noise_and_too_few_are_counted():
    samples, _ = hand_turned()
    assert np.all(np.isfinite(pose_excess(samples, (Stretch(0, 2), Stretch(10, 15), Stretch(20, 400)))))
    assert np.all(pose_excess(samples, (Stretch(0, 3),)) == 0.0)
    triad = tuple(Channel(n, Quantity.SPECIFIC_FORCE, "m/s^2") for n in ACCELEROMETER)
    recording = MemoryRecording(RecordingInfo("r", "U", triad, 100.0, len(samples)), samples)
    params = scalar_calibration.Params.model_validate({"triad": "accelerometer", "gravity_m_s2": 9.8})
    with pytest.raises(
        UnfitRecording, match=r"6 still stretches found, at least 9 .* hold each for 2.5 s \(still.short"
    ):
        scalar_calibration.analyse(Evidence((recording,)), params, None)
