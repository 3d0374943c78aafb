"""The catalogue's files: form, defaults, refusals, and from recordings to a stored result and back."""

import inspect
import json
from dataclasses import replace

import numpy as np
import pytest
from pydantic import ValidationError

from procedures import catalog, methods
from procedures.core.errors import BadParameter, DomainError, Undetermined
from procedures.core.imu_model import triad_calibration
from procedures.core.limits import Verdict
from procedures.core.recording import MemoryRecording, RecordingInfo
from procedures.core.report import Figure
from procedures.core.unit import Unit
from procedures.methods.scalar_calibration import METHOD as SCALAR
from procedures.procedure import Context, Evidence
from tests.kit.forward_model import (
    B_ACCELEROMETER,
    B_GYRO,
    K_ACCELEROMETER,
    K_GYRO,
    SITE,
    random_table,
    station_noise,
    station_recordings,
)
from tests.kit.procedures import require_form, simulated_context

CALIBRATION = catalog.discover()["calibration_12_orientations"]
VERIFICATION = catalog.discover()["verification_9_orientations"]
OURS = tuple(catalog.discover())


@pytest.mark.parametrize("name", OURS)
def test_a_procedure_is_named_as_its_file_and_has_a_schema(name: str):
    procedure = catalog.discover()[name]
    assert procedure.name == name
    json.dumps(procedure.params.model_json_schema())
    json.dumps(procedure.result.model_json_schema())
    assert inspect.isasyncgenfunction(procedure.acquire)


@pytest.mark.parametrize("name", list(methods.discover()))
def test_a_method_is_named_as_its_file_and_has_a_schema(name: str):
    method = methods.discover()[name]
    json.dumps(method.params.model_json_schema())
    json.dumps(method.result.model_json_schema())


@pytest.fixture
def calibrated() -> Context:
    """The simulated bench, which has a chamber, and its unit with a calibration: what every procedure can plan with."""
    triads = (("gyro", "rad/s", B_GYRO, K_GYRO), ("accelerometer", "m/s^2", B_ACCELEROMETER, K_ACCELEROMETER))
    made = tuple(
        triad_calibration(triad, unit, unit, np.column_stack([bias, matrix]), 1e-14 * np.eye(12))
        for triad, unit, bias, matrix in triads
    )
    context = simulated_context()
    return replace(context, unit=replace(context.unit, calibrations=made, calibration_ids=("c-1", "c-2")))


@pytest.mark.parametrize("name", OURS)
def test_a_procedure_keeps_the_form_that_every_one_has(name: str, calibrated: Context):
    require_form(catalog.discover()[name], calibrated)


@pytest.mark.parametrize(
    "bad",
    [
        {"dwell_s": float("nan")},
        {"dwell_s": 0.5},
        {"dwell_s": 1e6},
        {"orientations": ((0.0, float("nan")),) * 12},
        {"orientations": ((0.0, 361.0),) * 12},
        {"orientations": ((0.0, 0.0),) * 201},
        {"orientations": ()},
        {"rotation_order": "sideways"},
        {"weighting": "table"},
        {"gravity_m_s2": float("inf")},
        {"limits": {"gyro_scale_run_to_run_ppm": float("nan")}},
        {"dwel_s": 70.0},
    ],
)
def test_bad_parameters_are_refused(bad: dict[str, object]):
    with pytest.raises(ValidationError):
        CALIBRATION.params(**bad)


def test_schedule_before_resolve_says_what_is_missing():
    with pytest.raises(BadParameter, match="dwell_s"):
        CALIBRATION.schedule(CALIBRATION.params())


def test_one_does_not_verify_where_one_has_calibrated(context: Context):
    sets = [{s.angles for s in p.schedule(p.resolve(p.params(), context))} for p in (CALIBRATION, VERIFICATION)]
    assert len(sets[0]) == 12
    assert len(sets[1]) == 9
    assert len(sets[0] & sets[1]) == 1  # (0, 0, 0) alone is in both sets of the thesis


def test_the_other_rotation_order_is_refused_before_anything_moves(context: Context):
    with pytest.raises(Undetermined, match=r"scalar_check=false .*x–z"):
        CALIBRATION.predict(CALIBRATION.params(rotation_order="z_after_x"), context)
    prediction = CALIBRATION.predict(CALIBRATION.params(rotation_order="z_after_x", scalar_check=False), context)
    assert len(prediction.uncertainties) == 24


def test_too_few_orientations_are_refused_whatever_is_known_of_the_noise(context: Context):
    params = CALIBRATION.params(orientations=((0, 0), (0, 90), (0, 180)), scalar_check=False)
    with pytest.raises(Undetermined, match="K_i3"):
        CALIBRATION.predict(params, context)
    unknown = Unit("S-2", 400.0, context.unit.channels)
    with pytest.raises(Undetermined, match="K_i3"):
        CALIBRATION.predict(params, Context(unknown, context.bench))


def test_calibrate_store_verify(context: Context):
    rng = np.random.default_rng(17)
    params = CALIBRATION.resolve(CALIBRATION.params(), context)
    table = random_table(rng, 3.0, 5.0, 2.0, 10.0)
    noise = station_noise(CALIBRATION.schedule(params), context.unit)
    recordings = station_recordings(CALIBRATION.schedule(params), context.unit.channels, rng, table, noise)
    result = CALIBRATION.analyse(recordings, params, context)
    assert result.verdict is Verdict.PASS, result.checks
    assert {t.weighting for t in result.triads} == {"noise_and_table"}
    assert CALIBRATION.result.model_validate_json(result.model_dump_json()) == result
    assert result.warnings == CALIBRATION.predict(params, context).warnings
    calibrations = CALIBRATION.calibrations(result)
    truth = {
        "gyro": np.column_stack([B_GYRO, K_GYRO]),
        "accelerometer": np.column_stack([B_ACCELEROMETER, K_ACCELEROMETER]),
    }
    for c in calibrations:
        errors = (c.coefficients - truth[c.triad].ravel()) / c.standard_uncertainties
        assert np.abs(errors).max() < 4.0  # twelve numbers of unit spread, a fixed seed
    scalar = result.triads[1].scalar
    assert max(abs(p.difference_sigmas) for p in scalar.parameters) < 4.0
    figures = [s for s in CALIBRATION.report(result).sections if isinstance(s, Figure)]
    assert len(figures) == 8

    unit = Unit("S-1", 400.0, context.unit.channels, context.unit.gyro, context.unit.accelerometer, 70.0, calibrations)
    later = Context(unit, context.bench)
    params = VERIFICATION.resolve(VERIFICATION.params(), later)
    noise = station_noise(VERIFICATION.schedule(params), context.unit)
    recordings = station_recordings(VERIFICATION.schedule(params), unit.channels, rng, table, noise)
    verified = VERIFICATION.analyse(recordings, params, later)
    assert verified.verdict is Verdict.PASS, verified.checks
    assert verified.triads[1].magnitudes.sd_before > 500 * verified.triads[1].magnitudes.sd_after
    expected = {u.name: u.standard_uncertainty for u in VERIFICATION.predict(params, later).uncertainties}
    for t in verified.triads:
        # One sample of nine correlated errors: within a factor of three of what is expected.
        assert 1 / 3 < t.magnitudes.sd_after / expected[f"{t.magnitudes.triad}.sd after correction"] < 3
    assert VERIFICATION.result.model_validate_json(verified.model_dump_json()) == verified
    assert VERIFICATION.report(verified).sections


@pytest.mark.parametrize("weighting", ["noise_and_table", "noise"])
def test_scalar_and_linear_differ_by_what_is_claimed(context: Context, weighting: str):
    rng, sigmas = np.random.default_rng(18), []
    params = CALIBRATION.resolve(CALIBRATION.params(weighting=weighting), context)
    stations = CALIBRATION.schedule(params)
    noise = station_noise(stations, context.unit)
    for _ in range(40):
        table = random_table(rng, 3.0, 5.0, 2.0, 10.0)
        recordings = station_recordings(stations, context.unit.channels, rng, table, noise)
        result = CALIBRATION.analyse(recordings, params, context)
        sigmas.append([p.difference_sigmas for p in result.triads[1].scalar.parameters])
    # 40 × 9 numbers, correlated within nine: at least 40 free ones, relative error at most 1/√80 = 11 %; three of them.
    assert np.std(sigmas) == pytest.approx(1.0, abs=0.33)


def test_a_unit_of_unknown_noise_in_counts_is_calibrated_and_the_result_says_so(context: Context):
    unknown = Context(Unit("S-2", 400.0, context.unit.channels), context.bench)
    params = CALIBRATION.resolve(CALIBRATION.params(), unknown)
    recordings = station_recordings(
        CALIBRATION.schedule(params),
        unknown.unit.channels,
        np.random.default_rng(2),
        None,
        station_noise(CALIBRATION.schedule(params), context.unit),
    )
    result = CALIBRATION.analyse(recordings, params, unknown)
    assert all(t.p_value is None for t in result.triads)
    assert sum("noise" in w and "not known" in w for w in result.warnings) == 2


def test_there_is_nothing_to_verify_without_a_calibration(context: Context):
    with pytest.raises(DomainError, match="no calibration of its gyro triad"):
        VERIFICATION.predict(VERIFICATION.params(), context)


def test_no_operation_passes(context: Context):
    nothing = catalog.discover()["no_operation"]
    assert nothing.schedule(nothing.params()) == ()
    assert nothing.analyse([], nothing.params(), context).verdict is Verdict.PASS
    assert nothing.predict(nothing.params(), context).duration_s == 0.0


def test_scalar_method_over_stations(context: Context):
    params = CALIBRATION.resolve(CALIBRATION.params(), context)
    recordings = station_recordings(CALIBRATION.schedule(params), context.unit.channels)
    given = SCALAR.params(gravity_m_s2=SITE.gravity_m_s2)
    result = SCALAR.analyse(Evidence(tuple(recordings)), given, context.unit)
    assert result.verdict is Verdict.PASS
    assert SCALAR.result.model_validate_json(result.model_dump_json()) == result
    (calibration,) = SCALAR.calibrations(result)
    assert calibration.model == "scalar"
    assert calibration.bias_array == pytest.approx(B_ACCELEROMETER, abs=1e-9)
    assert SCALAR.report(result).sections


def test_scalar_method_over_one_hand_turned_recording(context: Context):
    rng, channels = np.random.default_rng(6), context.unit.channels[3:]
    directions = rng.normal(size=(20, 3))
    vectors = 9.81 * directions / np.linalg.norm(directions, axis=1)[:, None]
    poses = [np.tile(B_ACCELEROMETER + K_ACCELEROMETER @ v, (300 if k else 3000, 1)) for k, v in enumerate(vectors)]
    parts = [poses[0]]
    for pose in poses[1:]:
        parts += [np.linspace(parts[-1][-1], pose[0], 80), pose]
    samples = np.vstack(parts)
    samples += 0.01 * rng.normal(size=samples.shape)
    recording = MemoryRecording(RecordingInfo("hand", "S-1", channels, 100.0, len(samples)), samples)
    result = SCALAR.analyse(Evidence((recording,)), SCALAR.params(gravity_m_s2=9.81), None)
    assert result.poses == 20
    errors = [
        (p.estimate - b) / p.standard_uncertainty for p, b in zip(result.parameters, B_ACCELEROMETER, strict=False)
    ]
    assert np.abs(errors).max() < 4.0


def test_gravity_has_no_silent_default():
    with pytest.raises(ValidationError, match="gravity_m_s2"):
        SCALAR.params()
    assert SCALAR.params(triad="gyro").gravity_m_s2 is None
