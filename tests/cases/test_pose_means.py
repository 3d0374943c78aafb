"""A table of pose means is a way in: each row is one pose."""

from typing import Any

import numpy as np
import pytest
from scipy.stats import chi2

from procedures.core.errors import BadParameter
from procedures.core.recording import MemoryRecording, RecordingInfo
from procedures.methods.scalar_calibration import METHOD
from procedures.procedure import Evidence
from tests.cases.tables import chance, read, samples, table, triad

G = 9.81
BIAS = np.array([0.08, -0.05, 0.12])
SCALE = np.array([1.010, 0.990, 1.003])
SD = 1e-3


def _poses(count: int, seed: int) -> str:
    """Directions all over the sphere, each axis with its scale and bias: written in mg, as people keep them."""
    rng = chance(seed)
    towards = rng.normal(size=(count, 3))
    force = G * towards / np.linalg.norm(towards, axis=1)[:, None]
    read_out = SCALE * force + BIAS + rng.normal(0.0, SD, (count, 3))
    return table(["ax", "ay", "az"], (read_out / 9.80665e-3).round(6).tolist())


def _analysed(text: str, **parameters: Any) -> Any:
    imported = read(text, rate_hz=0.1, channels=triad("accelerometer", ["ax", "ay", "az"], "mg"))
    assert not any("unlikely" in warning for warning in imported.source["warnings"])
    info = RecordingInfo("r", "U", imported.channels, imported.rate_hz, imported.count)
    evidence = Evidence((MemoryRecording(info, samples(imported)),), ())
    asked = {"gravity_m_s2": G, "rows": "pose_means", **parameters}
    return METHOD.analyse(evidence, METHOD.params.model_validate(asked), None)


@pytest.mark.parametrize("known", [True, False])
def test_the_truth_lies_within_what_is_claimed(known: bool) -> None:
    truth = np.concatenate([BIAS, 1.0 / SCALE])
    pulls = []
    for seed in range(30):
        result = _analysed(_poses(40, seed), **({"pose_sd": SD} if known else {}))
        assert result.poses == 40
        found = np.array([[p.estimate, p.standard_uncertainty] for p in result.parameters[:6]])
        pulls.append((found[:, 0] - truth) / found[:, 1])
    # The 30 pulls of a parameter are independent and of unit variance: their sum of squares is chi-square with 30
    # degrees; six parameters, two sides, together 1 in 10^4. Where the noise comes from 31 residuals, the pulls are
    # Student's, with a variance of 31/29 and longer tails: 1.3 times the bound.
    totals = np.sum(np.square(pulls), axis=0)
    assert np.all(totals > chi2.ppf(1e-4 / 12, 30))
    assert np.all(totals < chi2.ppf(1.0 - 1e-4 / 12, 30) * (1.0 if known else 1.3))


def test_nine_poses_of_unknown_noise_leave_nothing_to_check() -> None:
    with pytest.raises(BadParameter, match="9 parameters leave nothing to check"):
        _analysed(_poses(9, 1))
    assert _analysed(_poses(9, 1), pose_sd=SD).degrees_of_freedom == 0
