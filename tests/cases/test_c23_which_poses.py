"""How many and which poses are enough for nine parameters, and what a wrong pose does: it fails and is named."""

import re

import numpy as np
import pytest

from procedures.core.limits import Verdict
from procedures.core.recording import MemoryRecording, RecordingInfo
from procedures.methods.scalar_calibration import METHOD
from procedures.procedure import Evidence
from tests.cases import calibrations as made
from tests.cases.calibrations import G

FACES = np.vstack([np.eye(3), -np.eye(3)])
GOLDEN = (1 + 5**0.5) / 2
CORNERS = np.array([(0, y, z * GOLDEN) for y in (1, -1) for z in (1, -1)]) / np.hypot(1, GOLDEN)
TWELVE = np.vstack([CORNERS, CORNERS[:, [2, 0, 1]], CORNERS[:, [1, 2, 0]]])
"""Faces of a dodecahedron."""
EIGHTEEN = np.vstack([FACES, [np.array(v) / 2**0.5 for v in made.EDGES]])
LEVEL = np.array([(0.56 * np.cos(a), 0.56 * np.sin(a), 0.83) for a in np.arange(8) * np.pi / 4])


def recordings(directions: np.ndarray, rng: np.random.Generator) -> tuple[MemoryRecording, ...]:
    bias, k, _ = made.triad(rng)
    unit = directions / np.linalg.norm(directions, axis=1)[:, None]
    means = bias + G * unit @ k.T
    return made.recorded("accelerometer", list(means[:, None] + rng.normal(0.0, 0.004, (len(means), 400, 3))))


def asked(given: tuple[MemoryRecording, ...], **parameters: float):
    return METHOD.analyse(Evidence(given), METHOD.params.model_validate({"gravity_m_s2": G, **parameters}), None)


@pytest.mark.parametrize(("poses", "rank"), [(FACES[:5], 5), (FACES, 6), (LEVEL, 5)])
def test_poses_that_do_not_determine_nine_are_refused_with_what_is_lost(poses: np.ndarray, rank: int) -> None:
    said = made.outcome(made.scalar_trial(recordings(poses, np.random.default_rng(23))))
    assert said.verdict == "refused"
    assert f"rank {rank} of 9" in said.said or "no pose turns it" in said.said


def test_nine_poses_say_that_nothing_is_left_to_check_with() -> None:
    given = recordings(TWELVE[[0, 1, 2, 3, 4, 5, 6, 8, 10]], np.random.default_rng(24))
    result = asked(given)
    assert (result.degrees_of_freedom, result.misfit) == (0, None)
    assert any("nothing is left to check the fit with" in w for w in result.warnings)


@pytest.mark.parametrize(("poses", "condition", "spare"), [(TWELVE, 2.24, 3), (EIGHTEEN, 2.45, 9)])
def test_enough_poses_pass_and_find_the_truth(poses: np.ndarray, condition: float, spare: int) -> None:
    rng = np.random.default_rng(25)
    x, y, z = poses.T
    design = np.column_stack([x, y, z, x * x, y * y, z * z, x * y, x * z, y * z])
    assert np.linalg.cond(design) == pytest.approx(condition, rel=0.005)
    # The product's columns have unit length, so that units do not matter.
    scaled = np.linalg.cond(design / np.linalg.norm(design, axis=0))
    truth = made.triad(np.random.default_rng(25))[2]
    result = asked(recordings(poses, rng))
    assert result.verdict is Verdict.PASS
    assert (result.condition, result.degrees_of_freedom) == (pytest.approx(scaled, rel=0.1), spare)
    found = np.array([(p.estimate, p.standard_uncertainty) for p in result.parameters])
    assert np.all(np.abs(found[:, 0] - truth) < 5 * found[:, 1])


@pytest.mark.parametrize("seed", range(10))
def test_one_wrong_pose_fails_and_is_named(seed: int) -> None:
    """Any pose, off along what it measures, which its magnitude feels whole."""
    rng = np.random.default_rng([23, seed])
    given, bad = list(recordings(EIGHTEEN, rng)), int(rng.integers(18))
    along = given[bad].raw.mean(axis=0)
    off = along / np.linalg.norm(along) * rng.choice([-1.0, 1.0]) * rng.uniform(0.05, 1.0)
    given[bad] = MemoryRecording(given[bad].info, given[bad].raw + off)
    result = asked(tuple(given))
    assert result.verdict is Verdict.FAIL
    assert result.misfit is not None
    assert result.misfit > 5.0
    assert re.match(rf"pose {bad + 1} ", result.worst), result.worst
    (failed,) = [c for c in result.checks if "scatter" in c.name]
    assert result.worst in failed.note


def test_a_misfit_within_one_long_recording_names_the_pose_by_its_time() -> None:
    rng = np.random.default_rng(26)
    given = list(recordings(EIGHTEEN, rng))
    given[4] = MemoryRecording(given[4].info, given[4].raw + np.array([0.0, 0.5, 0.0]))
    shake = [rng.normal(0.0, 2.0, (100, 3)) for _ in given]
    parts = [given[0].raw, given[0].raw, *(p for r, s in zip(given, shake, strict=True) for p in (s, r.raw))]
    raw = np.vstack(parts).astype(np.float64)
    first = given[0].info
    info = RecordingInfo("one", "U", first.channels, 50.0, len(raw))
    result = METHOD.analyse(
        Evidence((MemoryRecording(info, raw),)),
        METHOD.params.model_validate({"gravity_m_s2": G, "still": {"initial_s": 15.0}}),
        None,
    )
    assert result.poses == 19
    assert result.verdict is Verdict.FAIL
    assert re.match(r"pose 6 \(", result.worst), result.worst  # the rest at the beginning is the first


@pytest.mark.parametrize("name", made.BROKEN_SCALAR)
def test_what_is_broken_does_not_pass(name: str) -> None:
    rng = np.random.default_rng([27, *name.encode()])
    for _ in range(3):
        said = made.outcome(made.BROKEN_SCALAR[name](rng))
        assert said.caught, said


@pytest.mark.parametrize("name", made.CLEAN_SCALAR)
def test_what_is_clean_passes_under_any_noise(name: str) -> None:
    rng = np.random.default_rng([28, *name.encode()])
    said = [made.outcome(made.CLEAN_SCALAR[name](rng)) for _ in range(3)]
    assert all(s.passed for s in said), said
