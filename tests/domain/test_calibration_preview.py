"""Preview of a calibration before it runs: figures of the default plan, limits out of reach, what it rests on."""

import re
from dataclasses import replace

import numpy as np
import pytest

from procedures import catalog
from procedures.analysis.calibration.multiposition import fit_triad
from procedures.analysis.calibration.plan import TriadPlan, triad_plan
from procedures.analysis.calibration.verification import magnitudes
from procedures.core import units
from procedures.core.imu_model import triad_calibration
from procedures.core.unit import Unit
from procedures.procedure import Context
from tests.kit.exported_calibrations import UNITS
from tests.kit.forward_model import B_ACCELEROMETER, B_GYRO, K_ACCELEROMETER, K_GYRO

CALIBRATION = catalog.discover()["calibration_12_orientations"]
VERIFICATION = catalog.discover()["verification_9_orientations"]


def test_the_preview_of_the_default_plan(context: Context):
    prediction = CALIBRATION.predict(CALIBRATION.params(), context)
    by_name = {u.name: u for u in prediction.uncertainties}
    assert len(by_name) == 24
    # methods, errata: about 0.006 deg/h on a gyro's bias and 550 ppm on its scale factor.
    assert by_name["gyro.b_x"].standard_uncertainty / units.DEG_PER_HOUR == pytest.approx(0.0055, rel=0.1)
    assert by_name["gyro.K11"].standard_uncertainty / units.PPM == pytest.approx(530, rel=0.1)
    assert by_name["accelerometer.b_x"].from_noise / units.MICRO_G == pytest.approx(1.0, rel=0.1)
    # Gravity's magnitude tells biases and scale factors; 5″ are 24 ppm, of which the angles between axes keep a third.
    assert by_name["accelerometer.b_x"].from_table < 0.1 * by_name["accelerometer.b_x"].from_noise
    assert by_name["accelerometer.K11"].standard_uncertainty / units.PPM == pytest.approx(0.4, rel=0.1)
    assert 5.0 < by_name["accelerometer.K12"].from_table / units.PPM < 10.0
    assert all(u.standard_uncertainty == pytest.approx(np.hypot(u.from_noise, u.from_table)) for u in by_name.values())
    (warning,) = prediction.warnings
    assert "gyro scale factor" in warning
    # Magnitudes tell scale factors whatever the table's pointing, though only in the course of weeks.
    assert re.search(r"a dwell of about \d+ days", warning)
    assert "whole turns" in warning
    assert 12 * 72.0 < prediction.duration_s < 12 * 80.0


def test_the_preview_of_the_thesis_s_weights(context: Context):
    prediction = CALIBRATION.predict(CALIBRATION.params(weighting="noise"), context)
    by_name = {u.name: u for u in prediction.uncertainties}
    assert by_name["accelerometer.b_x"].from_noise / units.MICRO_G == pytest.approx(1.0, rel=0.1)
    assert all(u.standard_uncertainty == pytest.approx(np.hypot(u.from_noise, u.from_table)) for u in by_name.values())
    (warning,) = prediction.warnings
    assert "no dwell" in warning  # pointing alone is beyond the limit


def test_the_preview_says_what_it_rests_on(context: Context):
    assert "no calibration yet" in CALIBRATION.predict(CALIBRATION.params(), context).basis
    unknown = Context(Unit("S-2", 400.0, context.unit.channels), context.bench)
    assert CALIBRATION.predict(CALIBRATION.params(), unknown).basis == ""
    made = [
        triad_calibration(triad, unit, unit, np.column_stack([bias, matrix]).ravel(), 1e-20 * np.eye(12))
        for triad, unit, bias, matrix in (
            ("gyro", "rad/s", B_GYRO, K_GYRO),
            ("accelerometer", "m/s^2", B_ACCELEROMETER, K_ACCELEROMETER),
        )
    ]
    known = Context(replace(context.unit, calibrations=tuple(made), calibration_ids=("c-7", "c-8")), context.bench)
    assert CALIBRATION.predict(CALIBRATION.params(), known).basis == "calibration c-7 (gyro), c-8 (accelerometer)"
    assert VERIFICATION.predict(VERIFICATION.params(), known).basis == "calibration c-7 (gyro), c-8 (accelerometer)"
    gyro_only = Context(replace(known.unit, calibrations=(made[0],)), context.bench)
    expected = "calibration c-7 (gyro); accelerometer: nominal scale factors, uncertainties scale with the true ones"
    assert CALIBRATION.predict(CALIBRATION.params(), gyro_only).basis == expected


def test_a_limit_that_a_longer_dwell_reaches_is_told_with_the_dwell(context: Context):
    limits = {"gyro_bias_run_to_run_deg_h": 0.004, "gyro_scale_run_to_run_ppm": 1e4}
    (warning,) = CALIBRATION.predict(CALIBRATION.params(limits=limits), context).warnings
    assert "gyro bias" in warning
    hours = float(warning.split("about ")[1].split(" h")[0])
    params = CALIBRATION.params(limits=limits, dwell_s=hours * 3600 * 1.05)
    assert CALIBRATION.predict(params, context).warnings == ()


@pytest.mark.parametrize("triad", ["gyro", "accelerometer"])
def test_the_bias_in_run_of_a_calibration_is_foreseen_in_sample(context: Context, triad: str):
    """The mean of δ² over 120 calibrations of 12 orientations by the foreseen δ² is χ²/(120·ν), within 4.5 σ.

    A calibration follows its own outputs: the noise of the dwells alone, without the fit, is half as much again.
    """
    params = CALIBRATION.resolve(CALIBRATION.params(), context)
    site, stations = params.site(context), CALIBRATION.schedule(params)
    plan = triad_plan(triad, context.unit, stations, context.bench.axis_motion, site, params.table(site))
    planned = {c.check: c for c in CALIBRATION.planned_checks(params, context)}[f"{triad} bias in run, δ/√3"]
    dice, draws = np.random.default_rng(6), 120
    squares = np.array([in_run(plan, dice) for _ in range(draws)]) ** 2
    assert planned.standard_uncertainty is not None
    assert planned.degrees_of_freedom is not None
    foreseen = planned.standard_uncertainty * units.DISPLAY[UNITS[triad]][1]
    assert abs(squares.mean() / foreseen**2 - 1.0) < 4.5 * np.sqrt(2.0 / (draws * planned.degrees_of_freedom))


def in_run(plan: TriadPlan, dice: np.random.Generator) -> float:
    """δ/√3 of one calibration whose noise and table are drawn from the plan's, with K the identity and no bias."""
    noise = plan.noise_covariance()
    assert noise is not None
    turned = plan.vectors + plan.table.sensitivity @ (plan.table.sd * dice.normal(size=len(plan.table.sd)))
    drawn = np.array([np.linalg.cholesky(c) @ dice.normal(size=len(turned)) for c in noise]).T
    unit = UNITS[plan.triad]
    fit = fit_triad(plan.triad, unit, unit, plan.vectors, turned + drawn, noise, plan.table)
    reference = float(np.linalg.norm(plan.vectors[0]))
    return magnitudes(turned + drawn, fit.calibration(), reference, [""] * len(turned)).per_axis


def test_an_in_run_limit_beneath_the_noise_of_the_dwell_is_told(context: Context):
    params = CALIBRATION.params(
        dwell_s=5.0, limits={"gyro_scale_run_to_run_ppm": 1e5, "gyro_bias_run_to_run_deg_h": 1.0}
    )
    (warning,) = CALIBRATION.predict(params, context).warnings
    # 5 s: √2·0.39″/5 s is 0.11 deg/h, 0.0014 deg/√h over √(5 s) is 0.04 deg/h; over √3: far above 0.015.
    assert "gyro bias in run: the limit of 0.015 deg/h" in warning
