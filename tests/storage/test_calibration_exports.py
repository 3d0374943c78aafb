"""Calibrations as other software applies them: each consumer's own formula, or its own code, gives the true input.

The consumers' formulas are written here a second time, from their documents. A unit's output is made from a known input
by ``U = b + K·v``; after the consumer's correction the input is back.
"""

import json
import runpy
import shutil
import struct
import subprocess
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import yaml

import procedures.library as inertial
from bench_service.formats.calibration_exports.algebra import inverse_model, triangle_and_rotation
from bench_service.formats.calibration_exports.autopilots import lost
from bench_service.formats.calibration_exports.forms import CalibrationForm, exported
from bench_service.formats.calibration_exports.own_json import own_json
from bench_service.formats.calibration_exports.subject import CalibrationSubject
from procedures.core.errors import BadParameter
from procedures.core.imu_model import TriadCalibration, correct
from tests.kit.exported_calibrations import NOISE, UNITS, a_subject, a_triad, an_export

DEG = np.pi / 180.0
CC = shutil.which("cc")


def inputs(triad: str, seed: int = 9, n: int = 200) -> np.ndarray:
    """True rates up to 3 rad/s, or forces of 9.81 m/s² in all directions."""
    v = np.random.Generator(np.random.PCG64(seed)).normal(size=(n, 3))
    return v if triad == "gyro" else 9.81 * v / np.linalg.norm(v, axis=1)[:, None]


def outputs(value: TriadCalibration, v: np.ndarray) -> np.ndarray:
    return np.array(value.bias) + v @ np.array(value.matrix).T


def text(form: str, subject: CalibrationSubject | None = None) -> str:
    return exported(subject or a_subject(), CalibrationForm(form)).text


def ulps(found: np.ndarray, wanted: np.ndarray) -> float:
    """Largest departure in units in the last place of each vector's largest component."""
    place = np.spacing(np.abs(wanted).max(axis=1))
    return float((np.abs(found - wanted).max(axis=1) / place).max())


def compiled(folder: Path, source: str, triad: str, u: np.ndarray) -> np.ndarray:
    """The C function of a triad, compiled as strict C99 and run on samples; exact binary numbers in and out."""
    (folder / "calibration.h").write_text(source)
    (folder / "run.c").write_text(
        '#include <stdio.h>\n#include "calibration.h"\n'
        f"int main(void) {{ double u[3]; while (fread(u, 8, 3, stdin) == 3) {{ correct_{triad}(u, u);"
        " fwrite(u, 8, 3, stdout); } return 0; }\n"
    )
    flags = ["-std=c99", "-pedantic-errors", "-Wall", "-Werror", "-Wno-unused", "-O2", "-o", "run", "run.c"]
    subprocess.run([str(CC), *flags], cwd=folder, check=True)
    out = subprocess.run([str(folder / "run")], input=u.astype("<f8").tobytes(), capture_output=True, check=True).stdout
    return np.array(struct.unpack(f"<{u.size}d", out)).reshape(u.shape)


# A is rounded once (half an ulp of each term) and three products are summed: up to three and a half roundings of the
# largest component; the solver of `correct` makes as many. Four are the bound that is promised.
@pytest.mark.skipif(CC is None, reason="no C compiler here")
@pytest.mark.parametrize("count", [False, True])
@pytest.mark.parametrize("triad", list(UNITS))
def test_the_c_and_python_functions_agree_with_correct_within_four_ulp(tmp_path: Path, triad: str, count: bool) -> None:
    subject = a_subject(seed=3, count=count)
    one = subject.triad(triad)
    assert one is not None
    u = outputs(one.value, inputs(triad, n=2000))
    wanted = correct(u, one.value)
    in_c = compiled(tmp_path, text("c", subject), triad, u)
    assert ulps(in_c, wanted) <= 4.0
    (tmp_path / "calibration.py").write_text(text("python", subject))
    in_python = np.array([runpy.run_path(str(tmp_path / "calibration.py"))[f"correct_{triad}"](row) for row in u[:50]])
    assert ulps(in_python, wanted[:50]) <= 4.0
    np.testing.assert_allclose(in_c, inputs(triad, n=2000), rtol=0, atol=1e-13 * np.abs(wanted).max())


@pytest.mark.parametrize("triad", list(UNITS))
def test_the_python_function_takes_samples_in_rows_and_refuses_every_other_shape(triad: str) -> None:
    subject = a_subject(seed=4)
    one = subject.triad(triad)
    assert one is not None
    names: dict[str, Any] = {}
    exec(text("python", subject), names)
    function = names[f"correct_{triad}"]
    v = inputs(triad, n=7)
    u = outputs(one.value, v)
    for rows in (u, u[:3], u.tolist(), list(u), u[:1], u.reshape(7, 1, 3)):
        found = np.asarray(function(rows))
        assert found.shape == np.shape(rows)
        np.testing.assert_allclose(found.reshape(-1, 3), v[: found.size // 3], rtol=0, atol=1e-13 * np.abs(v).max())
    assert function(u[0].tolist()) == function(u.tolist())[0]
    for other in (u.T, u[:, :2], u[0, :2], u.T.tolist(), [1.0, 2.0], [1.0] * 4, [], list(u.T), u[0, 0]):
        with pytest.raises(ValueError, match=r"it must be one sample \(x, y, z\) or samples in rows, shape \(n, 3\)"):
            function(other)


def test_our_json_has_both_models_the_covariance_and_where_they_hold() -> None:
    subject = a_subject()
    document = json.loads(own_json(subject))
    for one, found in zip(subject.triads, document["triads"], strict=True):
        v = inputs(one.triad)
        u = np.array(found["forward"]["b"]) + v @ np.array(found["forward"]["K"]).T
        assert u.tolist() == outputs(one.value, v).tolist()  # the stored coefficients to the last bit
        back = u @ np.array(found["inverse"]["A"]).T + np.array(found["inverse"]["c"])
        np.testing.assert_allclose(back, v, rtol=0, atol=1e-13 * np.abs(v).max())
        assert found["covariance"]["matrix"] == [list(row) for row in one.value.covariance]
        assert found["covariance"]["order"][:2] == ["b_x", "K11"]
        assert found["temperature_c"] == [20.0, 23.0]
        assert found["validity"]["valid_until"] == "2027-01-02T00:00:00+00:00"
        assert found["lineage"]["recordings"][0]["content_hash"] == "f00d"
    assert "U = b + K·v" in document["formula"]["forward"]
    assert document["noise"]["gyro"]["process_noise_of_a_filter"]["rate"][0] == NOISE["gyro"][0].random_walk ** 2


@pytest.mark.parametrize("triad", list(UNITS))
def test_the_library_reads_our_json_back_to_the_last_bit(tmp_path: Path, triad: str) -> None:
    subject, file = a_subject(seed=6), tmp_path / "made.json"
    file.write_text(own_json(subject))
    one = subject.triad(triad)
    assert one is not None
    made = inertial.load_calibration(str(file), triad)
    assert (made.triad, made.unit, made.id, made.unusable) == (one.value, "U-1", f"c-{triad}", "")
    v = inputs(triad, n=5)
    np.testing.assert_allclose(made.correct(outputs(one.value, v)), v, rtol=0, atol=1e-13 * np.abs(v).max())
    np.testing.assert_allclose(made.correct(outputs(one.value, v)[0]), v[0], rtol=0, atol=1e-13 * np.abs(v).max())
    with pytest.raises(BadParameter, match="outputs"):
        made.correct(v.T)


def test_the_library_refuses_what_is_no_such_file_and_warns_of_one_that_is_not_for_use(tmp_path: Path) -> None:
    both, alone, other = tmp_path / "both.json", tmp_path / "alone.json", tmp_path / "other.json"
    both.write_text(own_json(a_subject()))
    rejected = an_export(a_triad("gyro", 1), unusable="it was rejected")
    alone.write_text(own_json(CalibrationSubject("U-1", 400.0, (rejected,), "c-gyro", "2026-02-01T00:00:00+00:00")))
    with pytest.raises(BadParameter, match="the file has both"):
        inertial.load_calibration(str(both))
    with pytest.warns(UserWarning, match="NOT FOR USE: it was rejected"):
        inertial.load_calibration(str(alone))
    with pytest.raises(BadParameter, match="what the file has: gyro"):
        inertial.load_calibration(str(alone), "accelerometer")
    for content, words in (
        ("", "cannot be read"),
        ("[]", "cannot be read"),
        ("{}", "has no field 'format'"),
        ('{"format": "imucal", "version": 1}', "cannot be read: format 'imucal', version 1"),
        ('{"format": "bench-calibration", "version": 1, "unit": "U-1", "triads": []}', "has no triad"),
        (alone.read_text().replace('"calibration": ', '"calibrated": '), "has no field 'calibration'"),
        (alone.read_text().replace('"unusable": ', '"usable": '), "has no field 'unusable'"),
        (both.read_text().replace('"b": [', '"b": [1,'), "cannot be read"),
    ):
        other.write_text(content)
        with pytest.raises(BadParameter, match=f"exported with format=json; this one {words}"):
            inertial.load_calibration(str(other))
    with pytest.raises(BadParameter, match="cannot be read"):
        inertial.load_calibration(str(tmp_path / "none.json"))


def test_the_covariance_of_the_inverse_is_that_of_chance_drawn_coefficients() -> None:
    """Monte Carlo of N = 40 000: a standard deviation is known to 1/√(2N) = 0.35 %; 2 % is 5.7 of these."""
    value = a_triad("accelerometer", 5)
    rng = np.random.Generator(np.random.PCG64(17))
    drawn = rng.multivariate_normal(value.coefficients, value.covariance_array, size=40_000, method="cholesky")
    rows = drawn.reshape(-1, 3, 4)
    a = np.linalg.inv(rows[:, :, 1:])
    c = -np.einsum("nij,nj->ni", a, rows[:, :, 0])
    seen = np.concatenate([c[:, :, None], a], axis=2).reshape(-1, 12)
    cov = inverse_model(value).covariance
    np.testing.assert_allclose(seen.std(axis=0), np.sqrt(np.diagonal(cov)), rtol=0.02)
    correlation = cov / np.sqrt(np.outer(np.diagonal(cov), np.diagonal(cov)))
    # standard deviation of a correlation: at most 1/√N = 0.005; five of them
    np.testing.assert_allclose(np.corrcoef(seen.T), correlation, atol=0.025)


@pytest.mark.parametrize("handed", [1.0, -1.0])
def test_the_split_is_a_triangle_times_a_rotation(handed: float) -> None:
    k = np.array(a_triad("gyro", 4).matrix) * handed
    lower, q = triangle_and_rotation(k)
    np.testing.assert_allclose(lower @ q, k, atol=1e-15)
    np.testing.assert_allclose(q @ q.T, np.eye(3), atol=1e-15)
    assert np.linalg.det(q) == pytest.approx(handed)
    assert np.all(np.diagonal(lower) > 0)
    assert np.all(np.triu(lower, 1) == 0)


def test_openvins_reads_the_true_input_although_it_keeps_lower_triangles_only() -> None:
    """Its model: w_m = Tw·R_IMUtoGYRO·w_I, a_m = Ta·a_I; its frame is R_imu_from_unit times ours."""
    subject = a_subject()
    read = yaml.safe_load(text("openvins", subject).removeprefix("%YAML:1.0\n"))["imu0"]
    _both_inputs(subject, np.tril(read["Ta"]), np.tril(read["Tw"]) @ np.array(read["R_IMUtoGYRO"]), read)
    assert read["R_IMUtoACC"] == np.eye(3).tolist()


def test_kalibr_reads_the_true_input() -> None:
    """Its model: a_m = M_a·a_i, w_m = M_g·C_gyro_i·w_i + A·a_i."""
    subject = a_subject()
    read = yaml.safe_load(text("kalibr", subject))["imu0"]
    rate = np.array(read["gyroscopes"]["M"]) @ np.array(read["gyroscopes"]["C_gyro_i"])
    _both_inputs(subject, np.array(read["accelerometers"]["M"]), rate, read)
    assert not np.any(read["gyroscopes"]["A"])


def _both_inputs(subject: CalibrationSubject, force: np.ndarray, rate: np.ndarray, read: dict) -> None:
    q = np.array(read["R_imu_from_unit"])
    for name, matrix in (("accelerometer", force), ("gyro", rate)):
        one = subject.triad(name)
        assert one is not None
        v = inputs(name)
        corrected = np.linalg.solve(matrix, (outputs(one.value, v) - np.array(one.value.bias)).T).T
        np.testing.assert_allclose(corrected @ q, v, atol=1e-13)  # from its frame to ours: v = Qᵀ·i
        assert np.abs(corrected - v).max() > 1e-3  # whoever drops Q turns the unit


def test_kalibr_noise_is_in_densities_and_has_no_bias_instability() -> None:
    """YAML 1.1 reads 1e-05 without a point as text: each value must come back as a number."""
    read = yaml.safe_load(text("kalibr-imu"))
    assert read == {
        "accelerometer_noise_density": 3e-4 * 3, "accelerometer_random_walk": 6e-7,
        "gyroscope_noise_density": 2e-5 * 3, "gyroscope_random_walk": 4e-8,
        "rostopic": "/imu0", "update_rate": 400.0,
    }  # fmt: skip


def test_the_json_has_the_mounting_of_its_triads() -> None:
    mounting = {"id": "m-1", "plate": "P2", "azimuth_deg": 12.5, "azimuth_sd_arcsec": 3.0}
    subject = a_subject()
    both = replace(subject, triads=tuple(replace(t, mounting=mounting) for t in subject.triads))
    assert json.loads(own_json(both))["mounting"] == mounting
    apart = replace(both, triads=(both.triads[0], subject.triads[1]))
    document = json.loads(own_json(apart))
    assert document["mounting"] is None
    assert [t["mounting"] for t in document["triads"]] == [mounting, None]


@pytest.mark.parametrize("form", ["kalibr", "kalibr-imu", "openvins"])
def test_a_random_walk_of_zero_is_refused_for_kalibr_takes_none(form: str) -> None:
    """Kalibr's reader of imu.yaml raises for every density that is not above zero."""
    subject = a_subject()
    silent = tuple(replace(c, random_walk=0.0) for c in subject.noise["gyro"])
    with pytest.raises(BadParameter, match=r"that of the gyros is 0; declare .* PUT /api/v1/units/U-1"):
        text(form, replace(subject, noise={**subject.noise, "gyro": silent}))


@pytest.mark.parametrize("form", ["kalibr", "kalibr-imu", "openvins"])
def test_for_a_rate_random_walk_that_was_not_observed_stands_one_that_an_hour_would_hide(form: str) -> None:
    subject = a_subject()
    steady = tuple(replace(c, rate_random_walk=0.0) for c in subject.noise["gyro"])
    written = text(form, replace(subject, noise={**subject.noise, "gyro": steady}))
    (walk,) = (float(line.split(":")[1]) for line in written.splitlines() if "gyroscope_random_walk:" in line)
    white = max(c.random_walk for c in steady)
    assert walk * np.sqrt(3600.0 / 3.0) == pytest.approx(white / np.sqrt(3600.0))
    assert "rate random walk of the gyros: 0, declared so or not observed" in written
    assert "rate random walk of the accelerometers" not in written


def _parameters(lines: str, cut: Callable[[str], tuple[str, float]]) -> dict[str, float]:
    return dict(cut(line) for line in lines.splitlines() if not line.startswith("#"))


@pytest.mark.parametrize("form", ["ardupilot", "px4"])
def test_autopilots_correct_all_but_the_loss_that_the_file_states(form: str) -> None:
    subject = a_subject()
    if form == "ardupilot":
        read = _parameters(text(form), lambda line: (line.split(",")[0], float(line.split(",")[1])))
        names = ["INS_ACCOFFS_{}", "INS_ACCSCAL_{}", "INS_GYROFFS_{}"]
    else:
        read = _parameters(text(form), lambda line: (line.split("\t")[2], float(line.split("\t")[3])))
        names = ["CAL_ACC0_{}OFF", "CAL_ACC0_{}SCALE", "CAL_GYRO0_{}OFF"]
    offset, scale, rate = (np.array([read[name.format(axis)] for axis in "XYZ"]) for name in names)
    assert len(read) == 9
    force, turn = subject.required("accelerometer", form), subject.required("gyro", form)
    v = inputs("accelerometer")
    left = np.abs((outputs(force.value, v) - offset) * scale - v).max(axis=0)
    assert np.all(left <= lost(force) * 9.81 / 9.80665)
    assert np.all(left > 0.1 * lost(force))  # the stated loss is no empty bound
    assert np.all((outputs(turn.value, np.zeros((1, 3))) - rate) == 0)
    assert "lost: cross terms of the accelerometers" in text(form)


def test_imucal_corrects_to_the_true_input_in_its_own_code(tmp_path: Path) -> None:
    from imucal.management import load_calibration_info

    for count in (False, True):
        subject = a_subject(count=count)
        (tmp_path / "c.json").write_text(text("imucal", subject))
        read = load_calibration_info(tmp_path / "c.json", file_type="json")
        force, turn = subject.required("accelerometer", ""), subject.required("gyro", "")
        f, w = inputs("accelerometer"), inputs("gyro")
        acc, gyr = outputs(force.value, f), outputs(turn.value, w) / (1.0 if count else DEG)
        units = ("a.u.", "a.u.") if count else ("m/s^2", "deg/s")
        got_f, got_w = read.calibrate(acc, gyr, *units)
        np.testing.assert_allclose(got_f, f, atol=1e-12)
        np.testing.assert_allclose(got_w * DEG, w, atol=1e-12)


def _matlab(script: str) -> dict[str, np.ndarray]:
    """Assignments of matrices in a script; constants of PSINS that divide stay a text beside them."""
    found = {}
    for line in script.splitlines():
        name, equals, rest = line.partition(" = [")
        if equals and not line.startswith("%"):
            rows = rest.partition("]")[0]
            found[name] = np.array([[float(x) for x in row.split()] for row in rows.split(";")])
    return found


def test_matlab_takes_rows_and_adds_b() -> None:
    subject = a_subject()
    read = _matlab(text("matlab", subject))
    for one in subject.triads:
        v = inputs(one.triad)
        found = outputs(one.value, v) @ read[f"A_{one.triad}"] + read[f"b_{one.triad}"]
        np.testing.assert_allclose(found, v, atol=1e-12)


def test_psins_makes_the_unit_s_output_from_the_true_input() -> None:
    """Its model: w_out = (I + dKg)·w + eb, f_out = (I + dKa)·f + db; dKGij in the order 21 31 32 12 13 23."""
    subject = a_subject()
    read = _matlab(text("psins", subject))
    d_g, d_a = np.diag(read["dKGii"].ravel()), np.diag(read["dKAii"].ravel())
    for (i, j), value in zip([(1, 0), (2, 0), (2, 1), (0, 1), (0, 2), (1, 2)], read["dKGij"].ravel(), strict=True):
        d_g[i, j] = value
    for (i, j), value in zip([(1, 0), (2, 0), (2, 1)], read["dKAij"].ravel(), strict=True):
        d_a[i, j] = value
    for name, error, bias in (("gyro", d_g, "eb"), ("accelerometer", d_a, "db")):
        v = inputs(name)
        in_its_frame = v @ read["Q"].T
        made = in_its_frame @ (np.eye(3) + error).T + read[bias].ravel()
        np.testing.assert_allclose(made, outputs(subject.required(name, "").value, v), atol=1e-13)
    assert "eb = " in text("psins")
    assert "/glv.dph;" in text("psins")


def test_pyins_and_navego_get_the_noise_in_their_units() -> None:
    subject = a_subject()
    read = json.loads(text("pyins", subject))
    gyro = subject.required("gyro", "").value
    v = inputs("gyro")
    made = (
        v @ np.array(read["gyro"]["InertialSensorError"]["transform"]).T + read["gyro"]["InertialSensorError"]["bias"]
    )
    np.testing.assert_allclose(made, outputs(gyro, v), atol=1e-15)
    sd = np.array(read["gyro"]["InertialSensorModel"]["scale_misal_sd"])
    assert sd[1, 2] == pytest.approx(gyro.covariance_array[7, 7] ** 0.5)  # K23 is the eighth of twelve
    script = _matlab(text("navego", subject))
    # imu_si_errors of NaveGo: arw/60·π/180, vrw/60, arrw/60·π/180, ab_sta·0.001·9.80665
    np.testing.assert_allclose(script["imu.arw"][0] / 60 * DEG, [c.random_walk for c in NOISE["gyro"]], rtol=1e-14)
    np.testing.assert_allclose(
        script["imu.arrw"][0] / 60 * DEG, [c.rate_random_walk for c in NOISE["gyro"]], rtol=1e-14
    )
    np.testing.assert_allclose(script["imu.vrw"][0] / 60, [c.random_walk for c in NOISE["accelerometer"]], rtol=1e-14)
    bias = subject.required("accelerometer", "").value.bias
    np.testing.assert_allclose(script["imu.ab_sta"][0] * 1e-3 * 9.80665, bias, rtol=1e-14)


def test_what_a_form_cannot_hold_is_refused_with_the_way_out() -> None:
    subject = a_subject()
    alone = CalibrationSubject("U-1", 400.0, subject.triads[:1], "c-gyro", "")
    for form in ("kalibr", "ardupilot", "px4", "imucal", "psins"):
        with pytest.raises(BadParameter, match="needs the accelerometer triad too"):
            exported(alone, CalibrationForm(form))
    for form in ("kalibr", "openvins", "ardupilot", "px4", "psins", "pyins", "navego"):
        with pytest.raises(BadParameter, match="outputs in count"):
            exported(a_subject(count=True), CalibrationForm(form))
    for form in ("kalibr-imu", "openvins", "pyins", "navego"):
        with pytest.raises(BadParameter, match="PUT /api/v1/units/U-1"):
            exported(a_subject(noise=False), CalibrationForm(form))


def test_a_file_says_that_a_calibration_may_not_be_used_and_no_text_leaves_its_comment() -> None:
    wild = an_export(a_triad("gyro", 1), simulated=True, unusable="rejected */\n#define x", origin="*/ int y;\nz = 1")
    subject = CalibrationSubject("U-1", 400.0, (wild,), "c-gyro", "")
    for form in ("c", "python", "matlab"):
        made = exported(subject, CalibrationForm(form)).text
        assert "NOT FOR USE" in made
        assert "SIMULATED" in made
        mark = {"c": "/*", "python": "#", "matlab": "%"}[form]
        assert all(line.startswith(mark) for line in made.splitlines() if "int y" in line or "define x" in line)
    assert exported(subject, CalibrationForm.C).text.count("*/ int y") == 0
