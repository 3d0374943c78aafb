"""Scalar calibration of two real units, held against what others found from the same recordings."""

import numpy as np
import pytest

from procedures.analysis.calibration.still import StillSettings, still_stretches
from procedures.core.recording import ACCELEROMETER, Channel, MemoryRecording, Quantity, RecordingInfo
from procedures.methods.scalar_calibration import METHOD, Result
from procedures.procedure import Evidence
from tests.shared_data import SHARED_DATA as DATA

pytestmark = [
    pytest.mark.shared_data,
    pytest.mark.skipif(not DATA.is_dir(), reason="the shared recordings are absent"),
]
COUNTS = tuple(Channel(name, Quantity.SPECIFIC_FORCE, "count") for name in ACCELEROMETER)


def xsens() -> np.ndarray:
    return np.loadtxt(DATA / "xsens_multi_position" / "xsens_acc.txt.gz")[:, 1:]


def mpu6050() -> np.ndarray:
    path = DATA / "mpu6050_static" / "ten_positions.csv.gz"
    return np.genfromtxt(path, delimiter=",", skip_header=5)[:, :3]


def calibrated(raw: np.ndarray, gravity_m_s2: float) -> Result:
    recording = MemoryRecording(RecordingInfo("real", "U", COUNTS, 100.0, len(raw)), raw)
    return METHOD.analyse(Evidence((recording,)), METHOD.params(gravity_m_s2=gravity_m_s2), None)


def test_the_poses_are_found_whatever_the_settings_in_reason():
    for factor in (6.0, 10.0, 20.0):
        for window_s in (1.0, 2.0):
            settings = StillSettings(20.0, window_s, factor, 0.75, 0.1)
            assert len(still_stretches(xsens(), 100.0, settings)) == 38
            assert len(still_stretches(mpu6050(), 100.0, settings)) == 10


def test_xsens_agrees_with_the_reference_within_two_standard_errors():
    result = calibrated(xsens(), 9.81744)
    assert result.poses == 38
    # imu_tk's own .calib: bias, scale, T upper triangular with the sign as it stands there; correct = T·K·(raw − bias).
    words = (DATA / "xsens_multi_position" / "reference_04_imu_tk_test_imu_acc.calib").read_text().split()
    t, k, bias = np.array(words[:9], float), np.array(words[9:18], float), np.array(words[18:], float)
    reference = np.array([*bias, *k[[0, 4, 8]], t[1], t[2], t[5]])
    found = np.array([p.estimate for p in result.parameters])
    sd = np.array([p.standard_uncertainty for p in result.parameters])
    assert np.all(np.abs(found - reference) < 2.0 * sd)
    assert np.all(sd[3:6] / found[3:6] < 2e-4)
    assert not any("undetermined" in w for w in result.warnings)


def test_ten_poses_of_an_mpu6050_give_scale_and_bias_and_admit_the_rest():
    result = calibrated(mpu6050(), 9.80665)
    assert result.poses == 10
    path = DATA / "mpu6050_static" / "optmization_result_data_params_acc.csv"
    reference = np.loadtxt(path)
    found = np.array([p.estimate for p in result.parameters])
    sd = np.array([p.standard_uncertainty for p in result.parameters])
    assert found[3:6] == pytest.approx(reference[3:6], rel=0.005)
    assert found[:3] == pytest.approx(-reference[6:], rel=0.05)  # its bias is added, ours is subtracted
    assert sd[6] > 0.01  # rad: one misalignment is as good as unknown, …
    assert any("t_xy is practically undetermined" in w for w in result.warnings)  # … and the result says so
