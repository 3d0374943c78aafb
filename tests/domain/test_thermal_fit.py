"""Thesis 4.1: worked by hand, recovered from data made by its inverse, uncertainties against Monte Carlo."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.stats import chi2

from procedures.analysis.thermal.fit import fit_axis, fit_correction
from procedures.analysis.thermal.runs import ThermalRun, thermal_run, without_lag
from procedures.core.errors import BadParameter, Undetermined, UnfitRecording
from procedures.core.thermal_correction import AxisCorrection, Form, ThermalCorrection

G = 9.81
CELL_S = 60.0
K0, B0 = 1.2, -0.09
ALPHA = (3e-8, 2e-5, -2e-8, -6e-5)
BETA = (9e-4, 3e-6, -7e-5, -1e-8)
REFERENCE = (20.4, 19.7)


def temperatures(cells: int = 720) -> tuple[np.ndarray, np.ndarray]:
    """Case and board: first-order lags of 15 and 25 minutes behind steps of the air, cell by cell."""
    air = np.repeat([20.0, -40.0, -20.0, 0.0, 20.0, 40.0, 60.0, 20.0], cells // 8)
    case, board = np.empty(cells), np.empty(cells)
    t, b = 20.0, 24.0
    for k, target in enumerate(air):
        t += (target - t) * -np.expm1(-CELL_S / 900.0)
        b += (t + 4.0 - b) * -np.expm1(-CELL_S / 600.0)
        case[k], board[k] = t, b
    return case, board


def made_run(up: int, noise: np.ndarray | None = None, cube: float = 0.0, force_x: float | None = None) -> ThermalRun:
    """A run whose every axis obeys the inverse of thesis 4.1 written out anew."""
    case, board = temperatures()
    dt, db = case - REFERENCE[0], board - REFERENCE[1]
    scale = K0 + ALPHA[0] * dt**2 + ALPHA[1] * dt + ALPHA[2] * db**2 + ALPHA[3] * db
    bias = B0 + BETA[0] * dt + BETA[1] * dt**2 + BETA[2] * db + BETA[3] * db**2 + cube * dt**3
    force = [G if axis == up else 0.0 for axis in range(3)]
    if force_x is not None:
        force[0] = force_x
    output = np.column_stack([f / scale - bias for f in force])
    if noise is not None:
        output = output + noise
    dynamic = np.abs(np.gradient(case)) > 0.2
    return ThermalRun(up, CELL_S, output, case, board, dynamic, (force[0], force[1], force[2]))


def found(fit) -> np.ndarray:
    return np.array([*fit.correction.alpha, *fit.correction.beta])


def test_t_4_1_by_hand() -> None:
    axis = AxisCorrection(2.0, 0.5, (1e-3, 1e-2, 2e-3, 2e-2), (0.1, 0.01, 0.2, 0.02), 20.0, 25.0)
    # Δt = 10, Δb = −5: 2 + 0.1 + 0.1 + 0.05 − 0.1 = 2.15; 3 + 0.5 + 1 + 1 − 1 + 0.5 = 5
    assert axis.apply(3.0, 30.0, 20.0, True)[0] == pytest.approx(2.15 * 5.0, rel=1e-14)
    assert axis.apply(3.0, 20.0, 25.0, False)[0] == pytest.approx(2.0 * 3.5, rel=1e-14)
    switched = replace(axis, form=Form.SWITCHED, dynamic_offset=(0.5, -0.25))
    assert switched.apply(3.0, 30.0, 20.0, False)[0] == pytest.approx(2.2 * 5.5, rel=1e-14)
    assert switched.apply(3.0, 30.0, 20.0, True)[0] == pytest.approx((1.95 + 0.5) * (3.0 - 0.25), rel=1e-14)
    single = replace(axis, form=Form.SINGLE)
    assert single.apply(3.0, 99.0, 20.0, False)[0] == pytest.approx(1.95 * 3.0, rel=1e-14)


def test_a_triad_takes_one_sensor_or_one_for_each_axis() -> None:
    axes = tuple(AxisCorrection(1.0, 0.0, beta=(b, 0.0, 0.0, 0.0)) for b in (1.0, 2.0, 3.0))
    triad = ThermalCorrection("accelerometer", (axes[0], axes[1], axes[2]))
    one = triad.apply(np.zeros((2, 3)), np.array([20.0, 21.0]), np.full(2, 20.0), False)
    np.testing.assert_allclose(one, [[0, 0, 0], [1, 2, 3]])
    own = triad.apply(np.zeros((1, 3)), np.array([[21.0, 22.0, 23.0]]), np.full(1, 20.0), False)
    np.testing.assert_allclose(own, [[1, 4, 9]])


def test_exact_data_give_the_coefficients_back() -> None:
    correction, fits = fit_correction([made_run(up) for up in range(3)], REFERENCE)
    for fit in fits:
        np.testing.assert_allclose(found(fit), [*ALPHA, *BETA], rtol=1e-6)
        assert fit.correction.scale == pytest.approx(K0, rel=1e-12)
        assert fit.correction.bias_m_s2 == pytest.approx(B0, rel=1e-9)
    run = made_run(1)
    specific = correction.apply(run.output_m_s2, run.case_c, run.converter_c, run.dynamic)
    np.testing.assert_allclose(specific - np.array([0.0, G, 0.0]), 0.0, atol=1e-9)


def test_a_horizontal_axis_that_leans_is_told_by_its_force() -> None:
    runs = [made_run(0), made_run(1, force_x=0.05), made_run(2, force_x=-0.02)]
    runs = [replace(run, output_m_s2=run.output_m_s2 + 1e-12) for run in runs]
    np.testing.assert_allclose(found(fit_axis(runs, 0, REFERENCE, Form.BOTH)), [*ALPHA, *BETA], rtol=1e-5)
    blind = [replace(run, force_m_s2=(G if run.up == 0 else 0.0, 0.0, 0.0)) for run in runs]
    wrong = found(fit_axis(blind, 0, REFERENCE, Form.BOTH))
    # To first order B takes the mean lean's share of A: ΔV = −c·A/K0², c̄ = 0.015 m/s².
    assert wrong[6] - BETA[2] == pytest.approx(0.015 * ALPHA[3] / K0**2, rel=0.05)


def test_claimed_uncertainties_are_the_spread_under_white_noise() -> None:
    rng, errors, claims, count = np.random.default_rng(4), [], [], 40
    exact = [made_run(up) for up in range(3)]
    for _ in range(count):
        runs = [replace(r, output_m_s2=r.output_m_s2 + 1e-5 * rng.standard_normal(r.output_m_s2.shape)) for r in exact]
        fit = fit_axis(runs, 0, REFERENCE, Form.BOTH)
        errors.append(found(fit) - [*ALPHA, *BETA])
        claims.append(fit.correction.standard_uncertainties())
    ratio = np.mean((np.array(errors) / np.array(claims)) ** 2, axis=0)
    # Chi-square of 40 units, eight looked at: one family in a thousand lies outside. The claim's own noise, fitted to
    # 2160 cells, is uncertain by a few per cent, hence the tenth more.
    low, high = chi2.ppf([0.5e-3 / 8, 1 - 0.5e-3 / 8], count) / count
    assert np.all((ratio > low) & (ratio < 1.1 * high))


def test_a_lag_that_is_not_known_is_in_the_claim() -> None:
    rng, lag_s = np.random.default_rng(3), 2.0
    exact = [made_run(up, 1e-9 * rng.standard_normal((720, 3))) for up in range(3)]
    late = [replace(r, case_c=r.case_c - lag_s * np.gradient(r.case_c, CELL_S)) for r in exact]
    _, fits = fit_correction(late, REFERENCE, lag_sd_s=(lag_s, 0.0))
    for fit in fits:
        error = found(fit) - [*ALPHA, *BETA]
        # An error of one standard uncertainty is claimed as such, to the second order of the lag.
        np.testing.assert_allclose(np.abs(error / fit.correction.standard_uncertainties())[[4, 6]], 1.0, atol=0.05)
    with pytest.raises(BadParameter, match="lag_sd_s"):
        fit_correction(exact, REFERENCE, lag_sd_s=(-1.0, 0.0))


def test_the_order_is_justified_by_the_data() -> None:
    rng = np.random.default_rng(5)
    noise = [1e-5 * rng.standard_normal((720, 3)) for _ in range(3)]
    square = fit_axis([made_run(up, noise[up]) for up in range(3)], 0, REFERENCE, Form.BOTH).order
    assert square.preferred == 2
    assert square.p_value[0] < 1e-6 < square.p_value[1]
    cube = fit_axis([made_run(up, noise[up], cube=1e-8) for up in range(3)], 0, REFERENCE, Form.BOTH).order
    assert cube.preferred == 3
    assert cube.p_value[1] < 1e-6


def test_the_older_forms_leave_what_they_cannot_follow() -> None:
    runs = [made_run(up, 1e-6 * np.random.default_rng(up).standard_normal((720, 3))) for up in range(3)]
    spread = {form: fit_axis(runs, 0, REFERENCE, form).residual_sd_m_s2 for form in Form}
    assert spread[Form.BOTH][1] < 2e-6
    assert spread[Form.SINGLE][1] > 100.0 * spread[Form.BOTH][1]
    assert spread[Form.SWITCHED][0] < spread[Form.SINGLE][0]
    single = fit_axis(runs, 0, REFERENCE, Form.SINGLE).correction
    assert single.alpha[:2] == single.beta[:2] == (0.0, 0.0)
    np.testing.assert_array_equal(single.standard_uncertainties()[[0, 1, 4, 5]], 0.0)


def test_a_cycle_in_which_the_sensors_never_part_is_refused() -> None:
    runs = [replace(made_run(up), converter_c=made_run(up).case_c + 4.0) for up in range(3)]
    with pytest.raises(Undetermined) as refused:
        fit_axis(runs, 0, REFERENCE, Form.BOTH)
    assert any("beta" in lost for lost in refused.value.lost)


def test_runs_that_cannot_do_are_refused() -> None:
    with pytest.raises(BadParameter, match="with axis y up at least once"):
        fit_axis([made_run(0), made_run(2)], 1, REFERENCE, Form.BOTH)
    with pytest.raises(BadParameter, match="cell_s"):
        fit_axis([made_run(0), replace(made_run(1), cell_s=30.0)], 0, REFERENCE, Form.BOTH)
    with pytest.raises(BadParameter, match="covariance"):
        AxisCorrection(1.0, 0.0).standard_uncertainties()
    with pytest.raises(BadParameter, match="all finite"):
        AxisCorrection(float("nan"), 0.0)


def series(count: int = 600) -> dict[str, np.ndarray]:
    ramp = 20.0 + 0.01 * np.arange(count)
    return {"output": np.zeros((count, 3)), "case": ramp, "converter": ramp - 1.0}


def test_cells_are_means_and_a_known_lag_is_taken_out() -> None:
    run = thermal_run(2, G, 1.0, series(), lag_s={"case": 5.0})
    assert run.force_m_s2 == (0.0, 0.0, G)
    np.testing.assert_allclose(run.case_c, 20.0 + 0.01 * (29.5 + 60.0 * np.arange(10)) + 0.05, rtol=0, atol=1e-9)
    np.testing.assert_allclose(run.converter_c, run.case_c - 1.05, rtol=0, atol=1e-9)
    assert run.dynamic.all()
    np.testing.assert_allclose(without_lag(series()["case"], 1.0, 0.0), series()["case"])


def test_bad_series_are_refused() -> None:
    with pytest.raises(BadParameter, match="cell_s"):
        thermal_run(0, G, 7.0, series())
    with pytest.raises(BadParameter, match="up"):
        thermal_run(3, G, 1.0, series())
    with pytest.raises(BadParameter, match=r"lag_s\.board"):
        thermal_run(0, G, 1.0, series(), lag_s={"board": 1.0})
    with pytest.raises(UnfitRecording, match="less than two cells"):
        thermal_run(0, G, 1.0, series(119))
    with pytest.raises(UnfitRecording, match="'case'"):
        thermal_run(0, G, 1.0, {**series(), "case": np.full(600, np.nan)})
    with pytest.raises(BadParameter, match="window_s"):
        without_lag(np.zeros(100), 1.0, 1.0, window_s=2.0)
