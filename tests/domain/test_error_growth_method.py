"""The method error_growth: what a calibration is worth in metres, and where it refuses."""

import numpy as np
import pytest

from procedures.core import units
from procedures.core.errors import BadParameter
from procedures.core.imu_model import triad_calibration
from procedures.core.limits import Verdict
from procedures.core.unit import TriadRecord, Unit
from procedures.methods.error_growth import METHOD, Declared
from procedures.procedure import DatedCalibration, Evidence
from tests.kit.forward_model import ACCELEROMETER_NOISE, GYRO_NOISE

NEARLY_NOTHING = dict.fromkeys(Declared.model_fields, 0.0)
W0 = np.sqrt(9.80665 / 6_371_000.0)


def dated(gyro_bias_sd: float, triads: tuple[str, ...] = ("gyro", "accelerometer")) -> DatedCalibration:
    made = {
        "gyro": triad_calibration(
            *("gyro", "rad/s", "rad/s"),
            np.column_stack([np.full(3, 1e-8), np.eye(3)]).ravel(),
            np.diag(np.tile([gyro_bias_sd, 0, 0, 0], 3) ** 2),
        ),
        "accelerometer": triad_calibration(
            *("accelerometer", "m/s^2", "m/s^2"), np.column_stack([np.zeros(3), np.eye(3)]).ravel(), np.zeros((12, 12))
        ),
    }
    return DatedCalibration("c1", "2026-01-01", tuple(made[name] for name in triads))


def test_an_hour_of_gyro_drift_is_s_4_39():
    """A drift of 0.01 deg/h swings and creeps to 0.77 km in an hour, by hand from textbook S 4.39."""
    drift = 0.01 * units.DEG_PER_HOUR
    params = METHOD.params(
        latitude_deg=0.0,
        alignment="given",
        tilt_sd_arcsec=0.0,
        heading_sd_arcsec=0.0,
        declared=NEARLY_NOTHING | {"gyro_bias_deg_h": 0.01},
    )
    result = METHOD.analyse(Evidence(), params, None)
    by_hand = drift * 6_371_000.0 / W0 * (W0 * 3600 - np.sin(W0 * 3600))
    north = next(c for c in result.curves if c.name == "north")
    at_hour = np.interp(3600.0, result.time_s, north.sd)
    # On the equator of a turning Earth the heading that drifts couples in a little (textbook S 4.124): (Ωt)² = 7 %.
    assert at_hour == pytest.approx(by_hand, rel=0.07)
    assert result.schuler_period_s / 60 == pytest.approx(84.4, abs=0.1)
    assert result.verdict is Verdict.PASS


def test_what_the_calibration_buys_is_said_in_metres_and_judged(unit: Unit):
    params = METHOD.params(latitude_deg=50.45, position_1h_max_m=500.0)
    good = METHOD.analyse(Evidence(calibrations=(dated(1e-4 * units.DEG_PER_HOUR),)), params, unit)
    poor = METHOD.analyse(Evidence(calibrations=(dated(0.1 * units.DEG_PER_HOUR),)), params, unit)
    assert good.calibration_radius_95_1h_m is not None
    assert poor.calibration_radius_95_1h_m is not None
    # Its own share is proportional to its uncertainty.
    assert poor.calibration_radius_95_1h_m / good.calibration_radius_95_1h_m == pytest.approx(1000.0, rel=1e-6)
    assert poor.shares[0].source == "gyro calibration"
    assert good.shares[0].source != "gyro calibration"
    assert [c.passed for c in poor.checks] == [True, True, False]
    assert f"{poor.radius_95_1h_m:.3g} m of the truth" in poor.sentence
    assert good.uncalibrated_1h_m is not None
    assert "nominal outputs" in good.sentence
    assert any("launch to launch is not known" in w for w in good.warnings)
    assert METHOD.result.model_validate_json(good.model_dump_json()) == good
    assert len(METHOD.report(good).sections) == 4


def test_the_changes_from_launch_to_launch_count_twice(unit: Unit):
    sd = 0.01 * units.DEG_PER_HOUR
    moving = Unit(
        "S-1", 1.0, (), TriadRecord((GYRO_NOISE,) * 3, sd), TriadRecord((ACCELEROMETER_NOISE,) * 3), calibrations=()
    )
    params = METHOD.params(latitude_deg=50.45, hours=1.0)
    result = METHOD.analyse(Evidence(calibrations=(dated(sd),)), params, moving)
    at_hour = {s.source: s.after_1h_m for s in result.shares}
    assert at_hour["gyro launch to launch"] / at_hour["gyro calibration"] == pytest.approx(np.sqrt(2.0), rel=1e-6)


def test_what_is_missing_is_asked_for(unit: Unit):
    params = METHOD.params(latitude_deg=50.45)
    with pytest.raises(BadParameter, match="declared"):
        METHOD.analyse(Evidence(), params, None)
    with pytest.raises(BadParameter, match="accelerometer triad is missing"):
        METHOD.analyse(Evidence(calibrations=(dated(1e-9, ("gyro",)),)), params, unit)
    with pytest.raises(BadParameter, match="one of each triad; two are of the gyro triad"):
        METHOD.analyse(Evidence(calibrations=(dated(1e-9),) * 2), params, unit)
    with pytest.raises(BadParameter, match="latitude_deg"):
        METHOD.analyse(Evidence(), METHOD.params(latitude_deg=90.0, declared={}), None)


def test_errors_too_large_for_linear_equations_fail_their_check():
    params = METHOD.params(latitude_deg=50.45, declared={"gyro_bias_deg_h": 100.0})
    result = METHOD.analyse(Evidence(), params, None)
    assert result.verdict is Verdict.FAIL
    assert not result.checks[1].passed
