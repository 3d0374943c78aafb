"""Six faces with rests and turns: exact on exact data, spread as claimed, both triads; and what is refused."""

from dataclasses import replace

import numpy as np
import pytest

from procedures.analysis.calibration.reference import reference_vectors
from procedures.analysis.calibration.station_noise import mean_covariance
from procedures.analysis.calibration.table_errors import TableUncertainty
from procedures.analysis.turns.ferraris import FACES, face_stations, ferraris_estimator, ferraris_flaws, rests_and_turns
from procedures.catalog import discover
from procedures.core import units
from procedures.core.errors import BadParameter, UnfitRecording
from procedures.core.limits import Verdict
from procedures.core.recording import MemoryRecording, Station
from procedures.inspection import analyse_procedure
from procedures.methods import discover as methods
from procedures.procedure import Evidence
from tests.kit.forward_model import B_GYRO, GYRO_NOISE, K_GYRO, SITE, turn
from tests.kit.procedures import acquired, require_form, simulated_context
from tests.kit.turn_outputs import Flaws, outputs

STATIONS = face_stations(60.0, 1, 30.0, 1.0, 2.0)
SECONDS = np.array([s.record_s for s in STATIONS])
WINDOWS = np.array([[100.0 * i, 100.0 * i + s] for i, s in enumerate(SECONDS)])
NONE = np.zeros((3, 2))
DECLARED = TableUncertainty(3.0, 1.0, 1.0, 5.0)
TRUTH = np.column_stack([B_GYRO, K_GYRO])


def earth_at_rest(station: Station) -> np.ndarray:
    """Integrated outputs of a rest: the Earth's rate in the unit's axes, by the table's matrices."""
    assert station.angles is not None
    rate = reference_vectors("gyro", [station.angles], SITE)[0]
    return (B_GYRO + K_GYRO @ rate) * station.record_s


@pytest.fixture(scope="module")
def sums() -> np.ndarray:
    turned = (outputs(s, Flaws(), NONE, np.zeros(3)) if s.turn is not None else earth_at_rest(s) for s in STATIONS)
    return np.array(list(turned))


def test_the_six_faces_are_six() -> None:
    forces = reference_vectors("accelerometer", list(FACES.values()), SITE) / SITE.gravity_m_s2
    expected = [[1, 0, 0], [-1, 0, 0], [0, 1, 0], [0, -1, 0], [0, 0, 1], [0, 0, -1]]
    assert forces == pytest.approx(np.array(expected, dtype=float), abs=1e-12)
    assert [s.turn is None for s in STATIONS] == [True, False, False] * 6


def test_exact_rests_and_turns_give_back_bias_and_matrix(sums: np.ndarray) -> None:
    motion = rests_and_turns(STATIONS, SECONDS, SITE)
    made = ferraris_estimator(motion, None, ferraris_flaws(motion, TableUncertainty()), np.eye(3))
    found = (made.gain @ sums.T.ravel()).reshape(3, 4)
    np.testing.assert_allclose(found[:, 1:], K_GYRO, atol=1e-8)
    np.testing.assert_allclose(found[:, 0], B_GYRO, atol=1e-3 * units.DEG_PER_HOUR)


def test_the_spread_of_the_gyros_is_as_claimed(sums: np.ndarray) -> None:
    """Twelve coefficients of 600 draws of noise and pointing: within 4.5/√(2·600) = 13 % of the claimed sd.

    Pointing by its definition: each axis anew at each station, and the outer one again at the end of the turns.
    """
    dice, n = np.random.default_rng(2), 600
    motion = rests_and_turns(STATIONS, SECONDS, SITE)
    noise = np.array([mean_covariance(GYRO_NOISE, WINDOWS)] * 3)
    made = ferraris_estimator(motion, noise, ferraris_flaws(motion, DECLARED), K_GYRO)
    root = np.linalg.cholesky(noise[0])
    turned = [i for i, s in enumerate(STATIONS) if s.turn is not None]
    right_angles = 3.0 * units.ARCSEC * dice.normal(size=(n, 2))
    found = np.zeros((n, 12))
    for k in range(n):
        y = sums + (root @ dice.normal(size=(len(STATIONS), 3))) * SECONDS[:, None]
        for i in turned:
            start, stop = units.ARCSEC * dice.normal(size=3), units.ARCSEC * dice.normal()
            y[i] += K_GYRO @ _turned(STATIONS[i], right_angles[k], start, stop)
        found[k] = made.gain @ y.T.ravel() - TRUTH.ravel()
    claimed = np.sqrt(np.diagonal(made.covariance))
    of_azimuth = np.sqrt(made.of_source("azimuth") ** 2 + made.of_source("level") ** 2)
    assert np.std(found, axis=0) == pytest.approx(np.sqrt(claimed**2 - of_azimuth**2), rel=0.13)
    assert claimed[[1, 6, 11]].max() < 2e-6, "a turn of 360° gives a part in a million"


def _turned(station: Station, right_angles: np.ndarray, start: np.ndarray, stop: float) -> np.ndarray:
    """Change of the turned vector in the unit's axes by small angles of the table, to first order, by differences."""
    a, whole = station.angles, station.turn
    assert a is not None
    assert whole is not None

    def vector(e: np.ndarray, s: np.ndarray, end: float) -> np.ndarray:
        deg = 180.0 / np.pi
        inside = (
            turn("x", e[0] * deg)
            @ turn("z", a.middle_deg + s[1] * deg)
            @ turn("y", e[1] * deg)
            @ turn("x", a.inner_deg + s[2] * deg)
        )
        return (2.0 * np.pi * whole.turns + end - s[0]) * np.array([0.0, 1.0, 0.0]) @ inside

    return vector(right_angles, start, stop) - vector(np.zeros(2), np.zeros(3), 0.0)


@pytest.fixture(scope="module")
def recordings() -> list[MemoryRecording]:
    procedure, context = discover()["ferraris_calibration"], simulated_context()
    params = procedure.resolve(procedure.params(rest_s=5.0), context)
    return acquired(procedure, procedure.schedule(params), seed=4)


def test_on_the_bench_as_predicted(recordings: list[MemoryRecording]) -> None:
    procedure, context = discover()["ferraris_calibration"], simulated_context()
    require_form(procedure, context)
    params = procedure.resolve(procedure.params(rest_s=5.0), context)
    result = analyse_procedure(procedure, recordings, params, context)
    assert result.verdict is Verdict.PASS, result.checks
    predicted = {u.name: u.standard_uncertainty for u in procedure.predict(params, context).uncertainties}
    of_result = {c.name: c.standard_uncertainty for c in result.gyro.coefficients}
    assert of_result == pytest.approx({name: predicted[name] for name in of_result}, rel=0.05)
    assert len(procedure.calibrations(result)) == 2
    assert {c.name for c in result.checks} <= set(procedure.quantities(params, context))
    titles = [section.title for section in procedure.report(result).sections]
    assert "Uncertainty budget of the accelerometer triad" in titles


def test_recordings_without_turns_or_rests_are_refused(recordings: list[MemoryRecording]) -> None:
    method, context = methods()["ferraris_calibration_of_recordings"], simulated_context()
    given = method.params(latitude_deg=50.45, gravity_m_s2=9.810553)
    found = method.analyse(Evidence(tuple(recordings[::-1])), given, context.unit)
    assert found.gyro.p_value is not None
    assert found.gyro.coefficients[0].name == "gyro.b_x"
    known = method.analyse(Evidence(tuple(recordings)), given.model_copy(update={"latitude_sd_arcsec": 60.0}), None)
    for budget, stated in zip(known.gyro.budgets, known.gyro.coefficients, strict=True):
        (row,) = [r for r in budget.rows if r.source == "latitude"]
        assert (row.value, row.unit) == (60.0, "arcsec")
        assert row.contribution == pytest.approx(stated.from_table_source["latitude"], rel=1e-9)
        assert budget.standard_uncertainty == pytest.approx(stated.standard_uncertainty, rel=1e-9)
    turning = [r for i, r in enumerate(recordings) if i % 3]
    for kind, kept in (("of whole turns", recordings[::3]), ("at rest", turning)):
        with pytest.raises(UnfitRecording, match=f"no recording {kind}"):
            method.analyse(Evidence(tuple(kept)), given, context.unit)
    lost = [replace(r, info=replace(r.info, station=None)) for r in recordings]
    with pytest.raises(UnfitRecording, match="table angles are not known"):
        method.analyse(Evidence(tuple(lost)), given, context.unit)


def test_a_table_that_cannot_turn_is_told() -> None:
    context = simulated_context()
    limited = replace(context, bench=replace(context.bench, outer=replace(context.bench.outer, continuous=False)))
    procedure = discover()["ferraris_calibration"]
    with pytest.raises(BadParameter, match="rate_deg_s"):
        procedure.predict(procedure.params(turns=3), limited)
    with pytest.raises(BadParameter, match="turns"):
        procedure.schedule(procedure.resolve(procedure.params(ramp_s=100.0), context))
