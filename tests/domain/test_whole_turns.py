"""Scale factor by whole turns: exact on exact data, spread as claimed, refused where it cannot work."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import pytest
from pydantic import TypeAdapter

from bench_service.model.quantities import quantities
from procedures.analysis.calibration.table_errors import TableUncertainty
from procedures.analysis.turns import fit as turns_fit
from procedures.analysis.turns import summary
from procedures.analysis.turns.fit import TERMS, Term, fit_turns, turn_flaws, turning
from procedures.analysis.turns.plan import UPRIGHT, TurnPlan, TurnProgram, bench_time_s, longer_needed
from procedures.bench.description import AxisLimits
from procedures.catalog.scale_factor_whole_turns import PROCEDURE
from procedures.core import units
from procedures.core.errors import BadParameter, Undetermined, UnfitRecording
from procedures.core.limits import Verdict
from procedures.core.noise import NoiseCoefficients
from procedures.core.recording import MemoryRecording, RecordingInfo, Station
from procedures.core.turn import Turn
from procedures.core.unit import TriadRecord, Unit
from procedures.procedure import Context
from tests.kit.forward_model import B_GYRO, GYRO_NOISE, K_GYRO, SITE, turn
from tests.kit.turn_outputs import REFERENCE, Flaws, outputs

PPM, ARCSEC = 1e-6, units.ARCSEC
EVEN = np.array([[30.0, -20.0], [-15.0, 25.0], [0.0, 40.0]]) * PPM
"""Asymmetry and quadratic term of each channel, at 50 deg/s."""
CUBIC = np.array([-12.0, 8.0, 20.0]) * PPM
WHITE = NoiseCoefficients(quantization=0.39 * ARCSEC, random_walk=0.0014 * units.DEG_PER_SQRT_HOUR)
SHORT = TurnProgram((20.0, 35.0, 50.0), 20.0, 1.0, 2.0, 1.0)


def recorded(stations: Sequence[Station], unit: Unit, sums: np.ndarray) -> list[MemoryRecording]:
    """Recordings of 40 samples whose gyros integrate to given angles (n, 3), with a little ripple; no other channel."""
    ripple = np.where(np.arange(40) % 2, 1e-7, -1e-7)[:, None]
    made, start = [], 10.0
    for station, total in zip(stations, sums, strict=True):
        info = RecordingInfo(station.label, "S-1", unit.channels[:3], 40 / station.record_s, 40, start, station)
        made.append(MemoryRecording(info, total / station.record_s + ripple))
        start += station.record_s + 3.0
    return made


@pytest.fixture
def turnable(context: Context) -> Context:
    outer = AxisLimits(-360.0, 360.0, 60.0, 100.0, continuous=True)
    return Context(replace(context.unit, gyro=TriadRecord((WHITE,) * 3)), replace(context.bench, outer=outer))


def truth(even: np.ndarray, cubic: np.ndarray) -> np.ndarray:
    return np.column_stack([B_GYRO, K_GYRO, even, cubic])


def test_the_exact_outputs_of_a_flawless_table_give_back_every_coefficient(turnable: Context) -> None:
    stations = SHORT.stations()
    sums = np.array([outputs(s, Flaws(), EVEN, CUBIC) for s in stations])
    motion = turning(stations, np.array([s.record_s for s in stations]), SITE)
    fit = fit_turns(motion, sums, TERMS, REFERENCE, None, turn_flaws(motion, TableUncertainty()))
    errors = fit.parameters - truth(EVEN, CUBIC)
    # Left out of a is the Earth's part, which the square multiplies: 2q·Ω/a₀ = 5e-9 of the scale factor at q = 40 ppm.
    np.testing.assert_allclose(errors[:, 1:4], 0, atol=1e-8)
    np.testing.assert_allclose(errors[:, 4:], 0, atol=2e-8)
    np.testing.assert_allclose(errors[:, 0], 0, atol=1e-3 * units.DEG_PER_HOUR)


@pytest.mark.parametrize(
    ("rate", "turns", "ramp_s"), [(10.0, 1, 0.5), (50.0, -6, 2.0), (60.0, 7, 40.0), (3.0, 1, 30.0)]
)
def test_the_earths_turn_is_that_of_the_motion_step_by_step(rate: float, turns: int, ramp_s: float) -> None:
    whole = Turn("outer", turns, rate, ramp_s)
    station = Station(0, "z up", UPRIGHT["z"], None, 0.0, whole.duration_s + 2.0, turn=whole)
    motion = turning([station], np.array([station.record_s]), SITE)
    zero = np.zeros((3, 2))
    stepped = np.linalg.solve(K_GYRO, outputs(station, Flaws(), zero, zero[:, 0]) - B_GYRO * station.record_s)
    # Simpson's error over 2000 steps of at most 1.1 deg is (1.1 deg)^4/180 of the Earth's 10″ a second.
    np.testing.assert_allclose((motion.turned_b + motion.earth_rad)[0], stepped, rtol=0, atol=1e-4 * ARCSEC)


@pytest.mark.parametrize("rate", [10.0, 60.0])
def test_the_earths_turn_changes_with_level_and_azimuth_as_the_flaws_say(rate: float) -> None:
    """By difference of the motion step by step, over 60″; what a tilt changes across the axis is left out.

    That is ``U·ε·|∫(cos, sin)θ dt|``, some seconds of rest and ramps of the whole: beneath a tenth of what is kept.
    """
    stations = TurnProgram((rate,), 60.0, 0.5, 2.0, 1.0).stations()
    motion = turning(stations, np.array([s.record_s for s in stations]), SITE)
    flaws, none = turn_flaws(motion, TableUncertainty(1.0, 1.0, 1.0, 1.0)), np.zeros((3, 2))
    exact = np.array([outputs(s, Flaws(), none, none[:, 0]) for s in stations])
    largest = np.abs(flaws.sensitivity[:, :, 2:5]).max()
    for column, changed in ((2, Flaws(level=(60.0, 0.0))), (3, Flaws(level=(0.0, 60.0))), (4, Flaws(azimuth=60.0))):
        found = np.array([outputs(s, changed, none, none[:, 0]) for s in stations]) - exact
        foreseen = 60.0 * ARCSEC * flaws.sensitivity[:, :, column] @ K_GYRO.T
        np.testing.assert_allclose(np.abs(found), np.abs(foreseen), atol=60.0 * ARCSEC * 0.1 * largest)


def test_the_earths_turn_along_the_axis_changes_with_the_latitude() -> None:
    """By central difference of the closed form over 20″; what changes across the axis is left out, as of a tilt."""
    stations = TurnProgram((10.0,), 60.0, 0.5, 2.0, 1.0).stations()
    seconds, step = np.array([s.record_s for s in stations]), 10.0 / 3600.0
    flaws = turn_flaws(turning(stations, seconds, SITE), TableUncertainty(latitude_sd_arcsec=1.0))
    sites = (replace(SITE, latitude_deg=SITE.latitude_deg + d) for d in (-step, step))
    south, north = (turning(stations, seconds, site) for site in sites)
    change = (north.earth_rad - south.earth_rad) / (2.0 * step * units.DEG)
    along = np.sum(change * north.axis_b, axis=1)[:, None] * north.axis_b
    np.testing.assert_allclose(flaws.sensitivity[:, :, -1], along, atol=1e-6 * np.abs(along).max())


def test_the_budget_of_each_coefficient_has_its_sources_and_makes_up_the_total(turnable: Context) -> None:
    declared = replace(turnable.bench.accuracy, level_sd_arcsec=1.0, orthogonality_sd_arcsec=3.0)
    site = replace(turnable.bench.site, azimuth_sd_arcsec=5.0, latitude_sd_arcsec=2.0)
    bench = replace(turnable.bench, accuracy=replace(declared, pointing_sd_arcsec=1.0), site=site)
    params, recordings = run(replace(turnable, bench=bench))
    result = PROCEDURE.analyse(recordings, params, replace(turnable, bench=bench))
    budgets = {str(b.coefficient): b for b in result.gyro.budgets}
    assert list(budgets) == [str(c.name) for c in result.gyro.coefficients]
    for c in result.gyro.coefficients:
        b = budgets[str(c.name)]
        assert np.sqrt(sum(r.contribution**2 for r in b.rows)) == pytest.approx(c.standard_uncertainty, rel=1e-9)
        for source, part in c.from_table_source.items():
            assert part == pytest.approx(sum(r.contribution for r in b.rows if r.source == source), rel=1e-9, abs=1e-18)
    sources = {"random walk", "resolution (quantization)", "orthogonality", "pointing", "level", "azimuth", "latitude"}
    assert {r.source for r in budgets["gyro.b_x"].rows} == sources
    # The stations about other axes give b_x without the tilt, so it can hardly enter: beneath Ω·cos φ·1″.
    north = SITE.earth_rate_rad_s * np.cos(np.radians(SITE.latitude_deg)) * ARCSEC
    of_level = next(r for r in budgets["gyro.b_x"].rows if r.source == "level")
    assert (of_level.value, of_level.unit) == (pytest.approx(1.0), "arcsec")
    assert 0.0 < of_level.contribution < north
    titles = [getattr(section, "title", "") for section in PROCEDURE.report(result).sections]
    assert "Uncertainty budget of the gyro triad" in titles


def test_errors_have_the_spread_that_is_claimed_and_residuals_the_chi_square(turnable: Context) -> None:
    """With 120 units each of 21 spreads is known to 6.5 %: within four of these; so the mean chi-square of 33 · 120."""
    rng, units_made = np.random.Generator(np.random.Philox(5)), 120
    stations = SHORT.stations()
    seconds = np.array([s.record_s for s in stations])
    motion = turning(stations, seconds, SITE)
    exact = np.array([outputs(s, Flaws(), 0 * EVEN, 0 * CUBIC) for s in stations])
    per_axis = per_flaw(stations, exact)
    noise = np.array([np.diag(2 * (WHITE.quantization / seconds) ** 2 + WHITE.random_walk**2 / seconds)] * 3)
    errors, claims, chi_square = [], [], []
    for _ in range(units_made):
        constant, each = rng.normal(size=2) * 3.0, rng.normal(size=(len(stations), 4)) * 1.0
        white = rng.normal(size=(len(stations), 3)) * (np.sqrt(np.diagonal(noise[0])) * seconds)[:, None]
        y = (
            exact
            + white
            + np.einsum("nfc,f->nc", per_axis[:, :2], constant)
            + np.einsum("nfc,nf->nc", per_axis[:, 2:], each)
        )
        fit = fit_turns(motion, y, TERMS, REFERENCE, noise, turn_flaws(motion, TableUncertainty(3.0, 1.0)))
        errors.append((fit.parameters - truth(0 * EVEN, 0 * CUBIC)).ravel())
        claims.append(np.sqrt(np.diagonal(fit.covariance)))
        chi_square.append(fit.chi_square / fit.degrees_of_freedom)
        assert fit.degrees_of_freedom == 33
    spread = np.sqrt(np.mean(np.square(np.array(errors) / np.array(claims)), axis=0))
    np.testing.assert_allclose(spread, 1.0, atol=4 / np.sqrt(2 * units_made))
    assert np.mean(chi_square) == pytest.approx(1.0, abs=4 * np.sqrt(2 / (33 * units_made)))


def per_flaw(stations: Sequence[Station], exact: np.ndarray) -> np.ndarray:
    """Change of the outputs an arcsecond of each flaw, by difference: two right angles, three pointings, the stop."""
    zero = np.zeros((3, 2))
    one = [
        Flaws((1.0, 0.0)),
        Flaws((0.0, 1.0)),
        *(Flaws(start=tuple(row)) for row in np.eye(3).tolist()),
        Flaws(stop=1.0),
    ]
    changed = np.array([[outputs(s, flaw, zero, zero[:, 0]) for flaw in one] for s in stations])
    return changed - exact[:, None]


def test_the_default_plan_resolves_a_part_in_a_million_in_ten_minutes_an_axis_and_says_so(turnable: Context) -> None:
    for unit in (turnable.unit, replace(turnable.unit, gyro=TriadRecord((GYRO_NOISE,) * 3))):
        bench = replace(turnable.bench, accuracy=replace(turnable.bench.accuracy, pointing_sd_arcsec=1.0))
        prediction = PROCEDURE.predict(PROCEDURE.params(), Context(unit, bench))
        sd = {u.name: u.standard_uncertainty for u in prediction.uncertainties}
        assert len(sd) == 21
        assert all(3 * sd[f"gyro.K{i}{i}"] < 1.0 * PPM for i in (1, 2, 3))
        assert prediction.warnings == ()
        assert prediction.duration_s < 3 * 600.0
        assert all(
            u.standard_uncertainty == pytest.approx(np.hypot(u.from_noise, u.from_table))
            for u in prediction.uncertainties
        )


def test_what_a_coarse_table_cannot_resolve_is_warned_of_with_the_way_out(turnable: Context) -> None:
    params = PROCEDURE.params(pointing_sd_arcsec=5.0)
    (warning,) = PROCEDURE.predict(params, turnable).warnings
    assert "3σ is to be within 1 ppm and the plan's is" in warning
    seconds = float(warning.split("turning_s = ")[1].split(" ")[0])
    assert seconds > 45.0
    assert PROCEDURE.predict(params.model_copy(update={"turning_s": seconds}), turnable).warnings == ()
    half = PROCEDURE.predict(params.model_copy(update={"turning_s": seconds / 2}), turnable)
    assert len(half.warnings) == 1
    hopeless = PROCEDURE.predict(PROCEDURE.params(pointing_sd_arcsec=3600.0), turnable)
    assert "no length of turning gets there" in hopeless.warnings[0]


def run(context: Context, **parameters: object) -> tuple[object, list[MemoryRecording]]:
    params = PROCEDURE.params(rates_deg_s=(20.0, 35.0, 50.0), turning_s=20.0, **parameters)
    stations = PROCEDURE.schedule(PROCEDURE.resolve(params, context))
    return params, recorded(stations, context.unit, np.array([outputs(s, Flaws(), EVEN, CUBIC) for s in stations]))


def test_from_recordings_to_a_result_and_back(turnable: Context) -> None:
    params, recordings = run(turnable, make_calibration=True)
    result = PROCEDURE.analyse(recordings, params, turnable)
    assert PROCEDURE.result.model_validate_json(result.model_dump_json()) == result
    found = result.gyro.coefficient("asymmetry_x")
    assert found.estimate == pytest.approx(30 * PPM, abs=2e-8)
    promised, given = PROCEDURE.quantities, quantities(result.model_dump(mode="json"))
    assert promised is not None
    assert set(promised(params, turnable)) == set(given), "every name, and no other"
    failed = {c.name for c in result.checks if not c.passed}
    assert result.verdict is Verdict.FAIL
    assert {"gyro asymmetry x", "gyro nonlinearity, quadratic z", "gyro nonlinearity, cubic z"} <= failed
    points = {(p.axis, p.rate_deg_s): p for p in result.gyro.points}
    assert len(points) == 18
    # At ±50 deg/s of axis x, short of its ramps: ±s/2 ± q + c, with the terms' own scale a/a₀ = K11 = 1.0048.
    at = points["x", 50.0].departure / PPM, points["x", -50.0].departure / PPM
    assert at == (pytest.approx(15 - 20 - 12, abs=2.5), pytest.approx(-15 + 20 - 12, abs=2.5))
    (calibration,) = PROCEDURE.calibrations(result)
    np.testing.assert_allclose(calibration.matrix_array, K_GYRO, atol=2e-9)
    assert PROCEDURE.calibrations(result.model_copy(update={"make_calibration": False})) == ()
    assert len(PROCEDURE.report(result).sections) == 6


def test_the_tables_flaws_are_worked_out_once_an_analysis(turnable: Context, monkeypatch: pytest.MonkeyPatch) -> None:
    params, recordings = run(turnable)
    calls: list[object] = []
    monkeypatch.setattr(summary, "turn_flaws", lambda *given: calls.append(given) or turn_flaws(*given))
    monkeypatch.setattr(turns_fit, "turn_flaws", lambda *given: calls.append(given) or turn_flaws(*given))
    PROCEDURE.analyse(recordings, params, turnable)
    assert len(calls) == 1


def test_unknown_noise_is_estimated_from_the_residuals(turnable: Context) -> None:
    unknown = Context(replace(turnable.unit, gyro=None), turnable.bench)
    params, recordings = run(unknown)
    rng = np.random.Generator(np.random.Philox(8))
    noisy = [replace(r, raw=r.raw + rng.normal(size=3) * 2.0 * ARCSEC / r.info.duration_s) for r in recordings]
    result = PROCEDURE.analyse(noisy, params, unknown)
    assert result.gyro.p_value is None
    assert "noise of the gyro triad is not known" in result.warnings[0]
    estimated = np.sqrt(result.gyro.chi_square / 33)
    assert estimated == pytest.approx(2.0, rel=4 / np.sqrt(2 * 33))  # in arcseconds, 33 degrees of freedom
    assert PROCEDURE.predict(params, unknown).uncertainties == ()


def test_recordings_that_do_not_hold_the_turns_are_refused(turnable: Context) -> None:
    params, recordings = run(turnable)
    lost = [replace(recordings[0], raw=0.7 * recordings[0].raw), *recordings[1:]]
    with pytest.raises(UnfitRecording, match=r"x \+20 deg/s.*gyro_x counted 0.7"):
        PROCEDURE.analyse(lost, params, turnable)
    exchanged = [replace(r, raw=r.raw[:, [1, 0, 2]]) for r in recordings]
    with pytest.raises(UnfitRecording, match="made: gyro_x and gyro_y are exchanged"):
        PROCEDURE.analyse(exchanged, params, turnable)
    apart = [replace(r, raw=r.raw[:, [1, 0, 2]] * (1.5, 0.7, 1.0)) for r in recordings]  # other nominal scale factors
    with pytest.raises(UnfitRecording, match="made: gyro_x and gyro_y are exchanged"):
        PROCEDURE.analyse(apart, params, turnable)
    still = replace(recordings[0].info, station=replace(recordings[0].info.station, turn=None))
    with pytest.raises(UnfitRecording, match="its station has no whole turns"):
        PROCEDURE.analyse([replace(recordings[0], info=still), *recordings[1:]], params, turnable)
    counts = [replace(c, unit="count") for c in recordings[0].info.channels]
    in_counts = [replace(r, info=replace(r.info, channels=tuple(counts))) for r in recordings]
    with pytest.raises(UnfitRecording, match="are in count"):
        PROCEDURE.analyse(in_counts, params, turnable)


@pytest.mark.parametrize(
    ("parameters", "error", "words"),
    [
        ({"rates_deg_s": (20.0,)}, Undetermined, "fewer terms need fewer rates"),
        ({"rates_deg_s": (61.0,), "terms": ()}, BadParameter, "outer rate of 61 deg/s is above 60"),
        ({"ramp_s": 0.5}, BadParameter, "ramps of"),
        ({"ramp_s": 50.0}, BadParameter, "the rate is not reached"),
    ],
)
def test_a_plan_that_cannot_work_is_refused_beforehand(turnable, parameters, error, words: str) -> None:
    with pytest.raises(error, match=words):
        PROCEDURE.predict(PROCEDURE.params(**parameters), turnable)


def test_a_table_without_slip_rings_is_refused(context: Context) -> None:
    with pytest.raises(BadParameter, match="it has no slip rings"):
        PROCEDURE.predict(PROCEDURE.params(), context)


def test_one_rate_is_enough_for_the_linear_coefficients(turnable: Context) -> None:
    terms: tuple[Term, ...] = ()
    prediction = PROCEDURE.predict(PROCEDURE.params(rates_deg_s=(40.0,), terms=terms), turnable)
    assert [u.name for u in prediction.uncertainties][:4] == ["gyro.b_x", "gyro.K11", "gyro.K12", "gyro.K13"]
    assert len(prediction.uncertainties) == 12


def test_a_station_with_turns_is_kept_as_json() -> None:
    adapter = TypeAdapter(tuple[Station, ...])
    stations = SHORT.stations()
    assert adapter.validate_json(adapter.dump_json(stations)) == stations
    document = adapter.dump_python(stations, mode="json")
    del document[0]["turn"]
    assert adapter.validate_python(document)[0].turn is None


def test_how_much_longer_is_found_in_powers_of_two(turnable: Context) -> None:
    plan = TurnPlan(
        SHORT, turnable.unit, turnable.bench.axis_motion, SITE, TableUncertainty(3.0, 1.0), TERMS, REFERENCE
    )
    assert longer_needed(plan, 1e-12) is None
    assert longer_needed(plan, 1.0) == 2
    assert len(bench_time_s(plan)[1]) == 3
    assert sum(bench_time_s(plan)[1]) == pytest.approx(bench_time_s(plan)[0])


def test_the_preview_of_a_unit_not_yet_calibrated_knows_of_cross_couplings(turnable: Context) -> None:
    """An axis that leans by ε puts K_ij·ε into a scale factor: a spread that the identity for K does not show.

    600 tables and units drawn; what is left of their outputs by the plan's own weights, against the prediction. The
    standard deviation of 600 draws is known to 1/√1200 = 3 % for a normal figure; a product of two is heavier in its
    tails (kurtosis 9: 6 %), so 25 % are four standard deviations.
    """
    sd, cross, rng = 30.0, 0.004, np.random.default_rng(31)
    unit = replace(turnable.unit, calibrations=())
    params = PROCEDURE.params(orthogonality_sd_arcsec=sd, pointing_sd_arcsec=0.0, cross_coupling_sd=cross)
    predicted = {u.name: u.from_table for u in PROCEDURE.predict(params, Context(unit, turnable.bench)).uncertainties}
    plan = TurnPlan(
        SHORT, unit, turnable.bench.axis_motion, SITE, TableUncertainty(sd), TERMS, REFERENCE, cross_coupling_sd=cross
    )
    made = plan.estimator()
    assert made is not None
    stations = SHORT.stations()
    angles = np.array([s.turn.angle_deg for s in stations if s.turn]) * units.DEG
    errors = []
    for _ in range(600):
        first, second = sd / 3600.0 * rng.standard_normal(2)
        k = np.eye(3) + cross * rng.standard_normal((3, 3)) * (1.0 - np.eye(3))
        leaning = []
        for s in stations:
            assert s.angles is not None
            inner, middle = turn("x", s.angles.inner_deg), turn("z", s.angles.middle_deg)
            skew = turn("x", first) @ middle @ turn("y", second) @ inner
            up = np.array([0.0, 1.0, 0.0])
            leaning.append(skew.T @ up - (middle @ inner).T @ up)
        change = angles[:, None] * np.array(leaning) @ k.T
        errors.append((made.gain @ change.T.ravel()).reshape(3, -1)[[0, 1, 2], [1, 2, 3]])
    spread = np.std(errors, axis=0)
    table = np.sqrt(np.sum(made.table_per_sd**2, axis=1)).reshape(3, -1)[[0, 1, 2], [1, 2, 3]]
    assert spread[1:] == pytest.approx(table[1:], rel=0.25)
    assert spread[0] <= 1.25 * table[0]  # x turns about the outer axis with both right angles beyond it
    assert all(predicted[f"gyro.K{i}{i}"] > 0.3 * cross * sd * ARCSEC for i in (2, 3))
    without = params.model_copy(update={"cross_coupling_sd": 0.0})
    bare = {u.name: u.from_table for u in PROCEDURE.predict(without, Context(unit, turnable.bench)).uncertainties}
    assert all(bare[f"gyro.K{i}{i}"] < 0.3 * predicted[f"gyro.K{i}{i}"] for i in (2, 3))
