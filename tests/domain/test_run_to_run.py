"""Tables 5.1 and 5.2 recomputed: the figures that the thesis's own coefficients give (methods, errata)."""

import numpy as np
import pytest

from procedures.analysis.repeatability.run_to_run import run_to_run, sd_interval
from procedures.core import units
from procedures.core.errors import BadParameter
from procedures.core.imu_model import TriadCalibration, triad_calibration
from procedures.core.limits import Verdict
from procedures.methods.run_to_run import METHOD
from procedures.procedure import DatedCalibration, Evidence

# Diagonals of K and biases of thesis Tables 5.1 and 5.2; the cross-couplings play no part here.
ACCELEROMETER = [
    ([0.090117, 0.092241, 0.12179], [0.8148, 0.85883, 0.85306]),
    ([0.090053, 0.092346, 0.121877], [0.81484, 0.858927, 0.853101]),
    ([0.090728, 0.092301, 0.121782], [0.814725, 0.858766, 0.852961]),
]
GYRO = [
    ([0.1856, 0.026498, -0.027218], [1.0048, 1.0017, 1.0009]),
    ([0.187935, 0.024217, -0.026688], [1.004767, 1.001702, 1.000873]),
    ([0.181159, 0.024417, -0.02817], [1.004807, 1.001763, 1.000919]),
]


def calibration(triad: str, bias: list[float], scale: list[float], sd: float = 0.0) -> TriadCalibration:
    size, unit = (units.DEG_PER_HOUR, "rad/s") if triad == "gyro" else (1.0, "m/s^2")
    coefficients = np.column_stack([np.array(bias) * size, np.diag(scale)]).ravel()
    variance = np.tile([(sd * size) ** 2, 0.0, 0.0, 0.0], 3)
    variance[[1, 6, 11]] = sd**2
    return triad_calibration(triad, unit, unit, coefficients, np.diag(variance))


def thesis(sd: float = 0.0) -> tuple[DatedCalibration, ...]:
    return tuple(
        DatedCalibration(str(i), "2014-11-13", (calibration("gyro", *g, sd), calibration("accelerometer", *a, sd)))
        for i, (g, a) in enumerate(zip(GYRO, ACCELEROMETER, strict=True))
    )


def test_accelerometers_of_table_5_1():
    found = run_to_run([calibration("accelerometer", *c) for c in ACCELEROMETER])
    assert [s.sd for s in found[:3]] == pytest.approx([3.7e-4, 5.3e-5, 5.2e-5], rel=0.02)
    assert [s.sd / units.PPM for s in found[3:]] == pytest.approx([72, 94, 84], abs=1.0)


def test_gyros_of_table_5_2():
    found = run_to_run([calibration("gyro", *c) for c in GYRO])
    assert [s.sd / units.DEG_PER_HOUR for s in found[:3]] == pytest.approx([0.0034, 0.0013, 0.00075], abs=6e-5)
    assert [s.sd / units.PPM for s in found[3:]] == pytest.approx([21, 36, 23], abs=1.0)


def test_the_gyro_scale_misses_its_limit_and_nothing_else_does():
    result = METHOD.analyse(Evidence(calibrations=thesis()), METHOD.params(), None)
    assert result.verdict is Verdict.FAIL
    assert {c.name for c in result.checks if not c.passed} == {f"gyro scale factor {axis} run to run" for axis in "xyz"}
    assert len(result.checks) == 12
    assert METHOD.result.model_validate_json(result.model_dump_json()) == result
    assert METHOD.report(result).sections


def test_only_the_thesiss_own_limits_have_it_for_their_source():
    params = METHOD.params(gyro_scale_run_to_run_ppm=5000.0)
    result = METHOD.analyse(Evidence(calibrations=thesis()), params, None)
    sources = {c.name: c.limit.source for c in result.checks}
    assert sources["gyro scale factor x run to run"] == "the request"
    assert sources["gyro bias x run to run"] == sources["accelerometer scale factor z run to run"] == "thesis 4.3, 5.6"


def test_a_limit_beneath_the_measurement_is_said_to_be_out_of_reach():
    result = METHOD.analyse(Evidence(calibrations=thesis(sd=0.0005)), METHOD.params(), None)
    notes = {c.name: c.note for c in result.checks}
    assert "not resolved" in notes["gyro scale factor x run to run"]
    assert notes["gyro bias x run to run"] == ""
    assert any("gyro scale factor x: the limit cannot be resolved" in w and "498 ppm" in w for w in result.warnings)


def test_the_interval_of_a_standard_deviation_by_hand():
    # n = 3: χ² of two degrees of freedom, quantiles 0.0506356 and 7.37776.
    assert sd_interval(1.0, 3) == pytest.approx((np.sqrt(2 / 7.37776), np.sqrt(2 / 0.0506356)), rel=1e-5)


def test_one_calibration_or_two_kinds_are_refused():
    with pytest.raises(BadParameter, match="at least two"):
        METHOD.analyse(Evidence(calibrations=thesis()[:1]), METHOD.params(), None)
    with pytest.raises(BadParameter, match="same triad"):
        run_to_run([calibration("gyro", *GYRO[0]), calibration("accelerometer", *ACCELEROMETER[0])])
