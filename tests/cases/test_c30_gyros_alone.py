"""The Earth's rate by half turns of a gyro whose bias is far larger and wanders: within its uncertainty."""

import numpy as np
import pytest

from procedures.core.errors import DomainError, UnfitRecording
from procedures.core.limits import Verdict
from procedures.core.recording import MemoryRecording
from procedures.methods.field_calibration import METHOD as FIELD
from procedures.methods.gyro_half_turns import METHOD, Result
from procedures.procedure import Evidence
from tests.cases import calibrations as made
from tests.cases.calibrations import EARTH

DEG = np.pi / 180.0
LATITUDE = 55.75
LEVEL = EARTH * np.cos(LATITUDE * DEG)
WHITE = 0.12 / 60.0 * DEG
"""rad/s/√Hz."""
DWELL_S, RATE_HZ = 75.0, 5.0


def turned(rng: np.random.Generator, recordings: int, walk: float, heading_deg: float = 0.0):
    """Alternate headings; z up, x and y level; a bias of .11 °/s that makes a step of `walk` [rad/s] at each turn."""
    n = int(DWELL_S * RATE_HZ)
    bias = np.array([0.11, -0.04, 0.02]) * DEG + np.cumsum(rng.normal(0.0, 1.0, (recordings, 3)) * walk, axis=0)
    angle = heading_deg * DEG + np.pi * np.arange(recordings)
    up = np.full(recordings, EARTH * np.sin(LATITUDE * DEG))
    earth = np.column_stack([LEVEL * np.cos(angle), -LEVEL * np.sin(angle), up])
    noise = rng.normal(0.0, WHITE * np.sqrt(RATE_HZ), (recordings, n, 3))
    return made.recorded("gyro", list((bias + earth)[:, None] + noise), rate_hz=RATE_HZ)


def asked(recordings: tuple[MemoryRecording, ...], **parameters: object) -> Result:
    params = METHOD.params.model_validate({"up": "z", "latitude_deg": LATITUDE, "relative_sd_max": 0.5, **parameters})
    return METHOD.analyse(Evidence(recordings), params, None)


@pytest.mark.parametrize("walk_deg_s", [0.0, 3e-4, 2.5e-3])
def test_half_differences_hold_the_rate_as_often_as_claimed(walk_deg_s: float) -> None:
    """200 series of ten pairs with a wandering bias: 95 % intervals of both level channels, in 92 to 98 %.

    400 intervals: the share's standard deviation is 1.1 %.
    """
    inside, ratio, passed = [], [], 0
    for seed in range(200):
        rng = np.random.default_rng([30, seed])
        heading = rng.uniform(0.0, 360.0)
        result = asked(turned(rng, 20, walk_deg_s * DEG, heading))
        truth = LEVEL * np.cos(heading * DEG), -LEVEL * np.sin(heading * DEG)
        x, y, _ = result.channels
        inside += [c.lower <= t <= c.upper for c, t in zip((x, y), truth, strict=True)]
        ratio.append(x.standard_uncertainty / x.within_sd)
        passed += result.verdict is Verdict.PASS
    assert 0.92 <= np.mean(inside) <= 0.98
    # A half difference has half of the bias's step beside N/√(2·75 s) = 1.63e-4 °/s of white noise.
    assert np.median(ratio) == pytest.approx(np.hypot(walk_deg_s / 2.0, 1.633e-4) / 1.633e-4, rel=0.1)
    assert passed >= 0.95 * 200 or walk_deg_s > 1e-3  # there 20 turns leave more than half of the rate uncertain


def test_a_bias_that_wanders_is_said_and_is_in_the_uncertainty() -> None:
    """As published: the scatter of series is eight times what white noise allows."""
    result = asked(turned(np.random.default_rng(31), 20, 2.5e-3 * DEG))
    x = result.channels[0]
    assert x.standard_uncertainty > 4.0 * x.within_sd
    assert any("the bias wanders between them" in w for w in result.warnings)


def test_turns_about_one_axis_give_no_matrix() -> None:
    recordings = turned(np.random.default_rng(32), 20, 0.0)
    assert any("do not determine scale factors" in w for w in asked(recordings).warnings)
    with pytest.raises(DomainError):
        made.SCALAR.analyse(Evidence(recordings), made.SCALAR.params.model_validate({"triad": "gyro"}), None)
    with pytest.raises(UnfitRecording, match="gyro_half_turns needs none"):
        FIELD.analyse(
            Evidence(recordings), FIELD.params.model_validate({"latitude_deg": LATITUDE, "gravity_m_s2": 9.81}), None
        )


def test_the_order_of_headings_may_be_given_and_too_few_pairs_are_refused() -> None:
    rng = np.random.default_rng(33)
    recordings = turned(rng, 12, 0.0)
    shuffled = tuple(recordings[i] for i in (1, 0, 2, 3, 5, 4, 6, 7, 9, 8, 10, 11))
    flags = tuple(i % 2 == 1 for i in (1, 0, 2, 3, 5, 4, 6, 7, 9, 8, 10, 11))
    assert asked(shuffled, turned=flags).channels[0].half_difference == pytest.approx(
        asked(recordings).channels[0].half_difference, rel=1e-9
    )
    with pytest.raises(UnfitRecording, match="2 pairs"):
        asked(recordings[:5])


def test_a_wrong_latitude_fails() -> None:
    recordings = turned(np.random.default_rng(34), 20, 0.0)
    params = METHOD.params.model_validate({"up": "z", "latitude_deg": 5.0, "relative_sd_max": 0.5})
    assert METHOD.analyse(Evidence(recordings), params, None).verdict is Verdict.FAIL
    assert len(METHOD.report(asked(recordings)).sections) == 1
