"""The method free_inertial: its judgement over many units against chance, a changed unit, and refusals."""

from typing import Any

import numpy as np
import pytest

from procedures.core import units
from procedures.core.errors import BadParameter, UnfitRecording
from procedures.core.imu_model import TriadCalibration, triad_calibration
from procedures.core.limits import Verdict
from procedures.core.noise import NoiseCoefficients
from procedures.core.recording import Channel, MemoryRecording, Quantity, RecordingInfo
from procedures.core.unit import TriadRecord, Unit
from procedures.methods.free_inertial import METHOD
from procedures.procedure import DatedCalibration, Evidence
from tests.kit.forward_model import CHANNELS, turn
from tests.kit.procedures import require_result

LATITUDE_DEG, GRAVITY, CELL_S = 50.0, 9.81, 10.0
WALK = {"gyro": 0.002 * units.DEG_PER_SQRT_HOUR, "accelerometer": 20.0 * units.MICRO_G}
LAUNCH = {"gyro": 0.003 * units.DEG_PER_HOUR, "accelerometer": 20.0 * units.MICRO_G}
BIAS_SD = {"gyro": 0.005 * units.DEG_PER_HOUR, "accelerometer": 30.0 * units.MICRO_G}
ATTITUDE = turn("y", -40.0) @ turn("z", 5.0) @ turn("x", -8.0)


def record(triad: str) -> TriadRecord:
    noise = NoiseCoefficients(random_walk=WALK[triad])
    return TriadRecord((noise, noise, noise), LAUNCH[triad])


PARAMS = METHOD.params.model_validate({"latitude_deg": 50.0, "gravity_m_s2": 9.81})
UNIT = Unit("S-1", 1.0 / CELL_S, CHANNELS, record("gyro"), record("accelerometer"))


def drawn(rng: np.random.Generator, hours: float = 2.0, more_deg_h: float = 0.0) -> tuple[Any, DatedCalibration]:
    """A recording at rest, one sample a cell, of a unit drawn with its calibration; `more_deg_h`: a gyro x bias."""
    latitude = np.radians(LATITUDE_DEG)
    true = {
        "gyro": ATTITUDE.T @ (units.EARTH_RATE * np.array([np.cos(latitude), np.sin(latitude), 0.0])),
        "accelerometer": ATTITUDE.T @ np.array([0.0, GRAVITY, 0.0]),
    }
    n = round(hours * 3600.0 / CELL_S)
    columns, made = [], []
    for t, unit in (("gyro", "rad/s"), ("accelerometer", "m/s^2")):
        bias, matrix = 10.0 * BIAS_SD[t] * rng.normal(size=3), np.eye(3) + 0.01 * rng.normal(size=(3, 3))
        spread = np.tile([BIAS_SD[t], 3e-6, 3e-6, 3e-6], 3)
        found = np.column_stack([bias, matrix]).ravel() + spread * rng.normal(size=12)
        made.append(triad_calibration(t, unit, unit, found, np.diag(spread**2)))
        launch = np.sqrt(2.0) * LAUNCH[t] * rng.normal(size=3)
        more = np.array([more_deg_h * units.DEG_PER_HOUR, 0.0, 0.0]) * (t == "gyro")
        white = WALK[t] / np.sqrt(CELL_S) * rng.normal(size=(n, 3))
        columns.append(bias + launch + more + matrix @ true[t] + white)
    info = RecordingInfo("r", "S-1", CHANNELS, 1.0 / CELL_S, n, 30.0, launched_s=0.0)
    return MemoryRecording(info, np.hstack(columns)), DatedCalibration("c1", "2026-01-01", tuple(made))


def analysed(recording: Any, calibration: DatedCalibration, unit: Unit | None = UNIT, **more: Any) -> Any:
    given = {"latitude_deg": LATITUDE_DEG, "gravity_m_s2": GRAVITY, "cell_s": CELL_S} | more
    return METHOD.analyse(Evidence((recording,), (calibration,)), METHOD.params.model_validate(given), unit)


def test_the_distance_of_many_units_is_as_chance_has_it():
    rng, n = np.random.default_rng(71), 60
    results = [analysed(*drawn(rng)) for _ in range(n)]
    p_values = np.array([r.p_value for r in results])
    # Uniform: standard deviation 0.289 of one; d² of two degrees of freedom has mean 2 and standard deviation 2.
    assert p_values.mean() == pytest.approx(0.5, abs=4.0 * 0.289 / np.sqrt(n))
    assert np.mean([r.mahalanobis**2 for r in results]) == pytest.approx(2.0, abs=4.0 * 2.0 / np.sqrt(n))
    inside = np.mean([r.radial_m[-1] <= r.radius_95_m[-1] for r in results])
    assert inside == pytest.approx(0.95, abs=4.0 * np.sqrt(0.95 * 0.05 / n))
    result = results[0]
    require_result(METHOD, result)
    assert result.attitude.heading_deg == pytest.approx(40.0, abs=0.2)
    assert result.attitude.pitch_deg == pytest.approx(5.0, abs=0.01)
    assert result.attitude.roll_deg == pytest.approx(-8.0, abs=0.01)
    assert len(METHOD.report(result).sections) == 4


def test_a_bias_that_changed_since_the_calibration_fails():
    """0.2 deg/h is 25 times the spread of launch and calibration together."""
    result = analysed(*drawn(np.random.default_rng(72), more_deg_h=0.2))
    assert result.verdict is Verdict.FAIL
    assert result.radial_m[-1] > result.radius_95_m[-1]
    assert "standard deviations" in result.sentence


def test_unknown_noise_is_not_judged_by_a_prediction_without_it():
    recording, calibration = drawn(np.random.default_rng(73))
    result = analysed(recording, calibration, None)
    assert result.verdict is Verdict.ERROR
    assert any("give `drift_max_m`" in w for w in result.warnings)
    assert analysed(recording, calibration, None, drift_max_m=1e6).verdict is Verdict.PASS
    assert analysed(recording, calibration, None, drift_max_m=1e-3).verdict is Verdict.FAIL


def test_refusals_name_the_way_out():
    recording, calibration = drawn(np.random.default_rng(74), hours=0.5)
    with pytest.raises(BadParameter, match=r"alignment_s = 1500\.0: at most 1200 s"):
        analysed(recording, calibration, alignment_s=1500.0)
    with pytest.raises(BadParameter, match="one recording of a unit at rest"):
        METHOD.analyse(
            Evidence((recording,) * 2, (calibration,)),
            PARAMS,
            UNIT,
        )
    with pytest.raises(BadParameter, match="the gyro triad has no calibration"):
        METHOD.analyse(Evidence((recording,)), PARAMS, UNIT)
    channels = tuple(Channel(c.name, Quantity(c.quantity), "count") for c in CHANNELS)
    counts = MemoryRecording(RecordingInfo("r", "S-1", channels, 0.1, len(recording.raw)), recording.raw)
    with pytest.raises(UnfitRecording, match="the gyro channels are in count, the calibration is for rad/s"):
        analysed(counts, calibration)
    on_end = turn("z", 89.0).T @ np.array([0.0, GRAVITY, 0.0])
    tipped = np.array(recording.raw)
    tipped[:, 3:] = on_end
    ideal: list[TriadCalibration] = [
        triad_calibration(t, u, u, np.eye(3, 4, 1).ravel(), np.zeros((12, 12)))
        for t, u in (("gyro", "rad/s"), ("accelerometer", "m/s^2"))
    ]
    with pytest.raises(UnfitRecording, match="cannot be aligned"):
        analysed(MemoryRecording(recording.info, tipped), DatedCalibration("c2", "2026-01-01", tuple(ideal)))
