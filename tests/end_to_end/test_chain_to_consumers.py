"""From a foreign log to a consumer: import, noise, calibration, export, and |a| at rest after its correction.

The unit is made here: ``U = b + K·v + n`` with b, K, n known to nobody else. Its logs are CSV files. What a consumer
does with its file is written from its own documents, or is its own code (imucal, the compiled C function), and
shares nothing with the exports. |a| must be g within the claimed uncertainty, and a wrong sign or order must show.
"""

import json
import runpy
import shutil
import struct
import subprocess
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pytest
import yaml

from bench_service.cli.asking.client import connect
from bench_service.settings import Settings
from tests.kit.consumer_files import (
    OF_THE_MATRIX,
    OF_THE_OFFSET,
    Numbers,
    assigned,
    commented_bias,
    of_ardupilot,
    of_px4,
    stated_loss,
)
from tests.kit.logged_unit import RATE_HZ, SIX, declare_noise, exported, found_noise, imported
from tests.service.client import Client

G, SD = 9.81, 1e-3
"""Gravity [m/s²], samples a second, noise of an accelerometer's sample [m/s²]: white, so N = SD/√RATE_HZ."""
GYRO_SD = 2e-5
"""Noise of a gyro's sample [rad/s]."""
POSES, HELD_OUT, POSE_S = 24, 20, 4.0
FACTOR = 4.0
"""Standard uncertainties within which |a| must be: 20 poses beyond 4σ by chance are 20·6e-5 = 0.1 %."""
CROSS = {"whole": 1e-2, "diagonal": 2e-4}
"""Size of K's other elements. |a| does not see a rotation: a transposed K shows by the square of this, 1e-4·g = 1e-3
m/s² where u is 2e-5. The autopilots have no place for such elements: a unit of theirs has small ones."""
CC = shutil.which("cc")


@dataclass(frozen=True)
class Chain:
    """One unit after import, noise and calibration: its exports, and fresh outputs of it at rest."""

    client: Client
    unit: str
    calibration: str
    gyro: str
    outputs: np.ndarray
    random_walk: float

    def export(self, form: str) -> str:
        return exported(self.client, self.unit, self.calibration, self.gyro, form)

    @property
    def uncertainty(self) -> np.ndarray:
        """Standard uncertainty of |a| of each held-out pose, by the covariance in our JSON and the noise found.

        |a| = |K⁻¹(U − b)|, so d|a| = −â·K⁻¹·(db + dK·v): the gradient by (b_i, K_ij) is −(K⁻ᵀâ)_i·(1, v_j).
        """
        document = json.loads(self.export("json"))
        (one,) = [t for t in document["triads"] if t["triad"] == "accelerometer"]
        b, k = np.array(one["forward"]["b"]), np.array(one["forward"]["K"])
        v = np.linalg.solve(k, (self.outputs - b).T).T
        pull = (v / np.linalg.norm(v, axis=1)[:, None]) @ np.linalg.inv(k)
        gradient = np.einsum("pi,pj->pij", pull, np.column_stack([np.ones(len(v)), v])).reshape(len(v), 12)
        of_calibration = np.einsum("pi,ij,pj->p", gradient, np.array(one["covariance"]["matrix"]), gradient)
        return np.sqrt(of_calibration + (pull**2).sum(axis=1) * self.random_walk**2 / POSE_S)


def directions(rng: np.random.Generator, n: int) -> np.ndarray:
    v = rng.normal(size=(n, 3))
    return v / np.linalg.norm(v, axis=1)[:, None]


def chain(client: Client, unit: str, cross: float, seed: int) -> Chain:
    rng = np.random.Generator(np.random.PCG64(seed))
    k = np.diag(1.0 + rng.uniform(-0.01, 0.01, 3)) + cross * rng.uniform(-1.0, 1.0, (3, 3)) * (1 - np.eye(3))
    b = rng.uniform(0.03, 0.08, 3) * rng.choice([-1.0, 1.0], 3)

    def out(v: np.ndarray) -> np.ndarray:
        return b + v @ k.T + SD * rng.normal(size=v.shape)

    rest = np.tile(directions(rng, 1) * G, (60_000, 1))
    still = imported(client, unit, np.column_stack([out(rest), GYRO_SD * rng.normal(size=rest.shape)]))
    walks = found_noise(client, still)
    per_pose, moving = int(POSE_S * RATE_HZ), int(RATE_HZ)
    pieces = [np.tile(directions(rng, 1) * G, (2000, 1))]
    for up in directions(rng, POSES):
        shaken = pieces[-1][-1] + (up * G - pieces[-1][-1]) * np.linspace(0, 1, moving)[:, None]
        pieces += [shaken + rng.normal(size=(moving, 3)), np.tile(up * G, (per_pose, 1))]
    poses = imported(client, unit, out(np.concatenate(pieces)), SIX[:3])
    answer = client.analyse("scalar_calibration", recordings=[poses], parameters={"gravity_m_s2": G})
    assert (answer.status_code, answer.json()["verdict"]) == (201, "pass"), answer.text
    listed = client.http.get(f"/api/v1/units/{unit}/calibrations").json()["items"]
    made = next(c["id"] for c in listed if c["triad"] == "accelerometer")
    gyro = gyro_calibration(client, unit)
    declare_noise(client, unit, walks)
    fresh = np.stack([out(np.tile(up * G, (per_pose, 1))).mean(axis=0) for up in directions(rng, HELD_OUT)])
    return Chain(client, unit, made, gyro, fresh, walks["accelerometer_x"])


def gyro_calibration(client: Client, unit: str) -> str:
    """A calibration of the gyros as their passport has it: several files hold both triads."""
    names = [n for axis, i in zip("xyz", "123", strict=True) for n in (f"b_{axis}", f"K{i}1", f"K{i}2", f"K{i}3")]
    rows = [
        {
            "name": n,
            "value": float(n in ("K11", "K22", "K33")),
            "unit": "rad/s" if n[0] == "b" else "1",
            "standard_uncertainty": 1e-6,
        }
        for n in names
    ]
    body = {"triad": "gyro", "origin": "passport 1", "coefficients": rows}
    answer = client.http.post(f"/api/v1/units/{unit}/calibrations", json=body)
    assert answer.status_code == 201, answer.text
    return answer.json()["id"]


@pytest.fixture(scope="module")
def client(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Client]:
    file = tmp_path_factory.mktemp("chain") / "bench.sqlite"
    with connect(Settings(database_url=f"sqlite:///{file}"), None, drive=False) as http:
        yield Client(http)


@pytest.fixture(scope="module")
def whole(client: Client) -> Chain:
    return chain(client, "CHAIN-1", CROSS["whole"], seed=11)


@pytest.fixture(scope="module")
def diagonal(client: Client) -> Chain:
    return chain(client, "CHAIN-2", CROSS["diagonal"], seed=12)


BIAS = "accelerometer bias [m/s^2]"
"""Words of the comment that has it."""


def by_kalibr(text: str) -> Numbers:
    """Kalibr's model: a_m = M·a_i; the bias is no field, it stands in a comment of the file."""
    read = yaml.safe_load(text)["imu0"]["accelerometers"]
    return {"offset": commented_bias(text, BIAS), "matrix": np.array(read["M"])}


def by_openvins(text: str) -> Numbers:
    """OpenVINS, model kalibr: a_m = Ta·a_I, of which it keeps the lower triangle."""
    read = yaml.safe_load(text.removeprefix("%YAML:1.0\n"))["imu0"]
    return {"offset": commented_bias(text, BIAS), "matrix": np.tril(np.array(read["Ta"]))}


def by_matlab(text: str) -> Numbers:
    """MATLAB's accelcal: C = U·A + b on rows."""
    found = assigned(text)
    return {"offset": found["b_accelerometer"].ravel(), "matrix": found["A_accelerometer"]}


def by_psins(text: str) -> Numbers:
    """PSINS: f_out = (I + dKa)·f + db, dKa lower triangular."""
    found = assigned(text)
    matrix = np.eye(3) + np.diag(found["dKAii"].ravel())
    for (i, j), value in zip([(1, 0), (2, 0), (2, 1)], found["dKAij"].ravel(), strict=True):
        matrix[i, j] = value
    return {"offset": found["db"].ravel(), "matrix": matrix}


def by_ardupilot(text: str) -> Numbers:
    """ArduPilot: (raw − INS_ACCOFFS)·INS_ACCSCAL of each axis."""
    read = of_ardupilot(text)
    return _of_axes(*([read[f"INS_{name}_{axis}"] for axis in "XYZ"] for name in ("ACCOFFS", "ACCSCAL")))


def by_px4(text: str) -> Numbers:
    """PX4: (raw − OFF)·SCALE of each axis."""
    read = of_px4(text)
    return _of_axes(*([read[f"CAL_ACC0_{axis}{name}"] for axis in "XYZ"] for name in ("OFF", "SCALE")))


def _of_axes(offset: list[float], scale: list[float]) -> Numbers:
    return {"offset": np.array(offset), "matrix": np.diag(1.0 / np.array(scale))}


def forward(numbers: Numbers, u: np.ndarray) -> np.ndarray:
    """Correction by a forward model: solve U = offset + matrix·a."""
    return np.linalg.solve(numbers["matrix"], (u - numbers["offset"]).T).T


def on_rows(numbers: Numbers, u: np.ndarray) -> np.ndarray:
    return u @ numbers["matrix"] + numbers["offset"]


MUTATIONS = {**OF_THE_OFFSET, **OF_THE_MATRIX}
CONSUMERS = {
    "kalibr": (by_kalibr, forward), "openvins": (by_openvins, forward), "matlab": (by_matlab, on_rows),
    "psins": (by_psins, forward), "ardupilot": (by_ardupilot, forward), "px4": (by_px4, forward),
}  # fmt: skip


def worst(found: np.ndarray, allowed: np.ndarray) -> float:
    """Largest | |a| − g | as a multiple of what is allowed."""
    return float(np.max(np.abs(np.linalg.norm(found, axis=1) - G) / allowed))


def allowance(one: Chain, form: str, text: str) -> np.ndarray:
    """Claimed uncertainty; of the autopilots also the loss that their file states, which is of one g on every axis."""
    loss = 0.0
    if form in ("ardupilot", "px4"):
        loss = stated_loss(text, "lost: cross terms of the accelerometers")
    return FACTOR * one.uncertainty + loss


@pytest.mark.parametrize("form", list(CONSUMERS))
def test_a_is_g_after_the_consumer_s_correction_and_not_after_a_wrong_one(
    form: str, whole: Chain, diagonal: Chain
) -> None:
    one = diagonal if form in ("ardupilot", "px4") else whole
    text = one.export(form)
    read, apply = CONSUMERS[form]
    numbers, allowed = read(text), allowance(one, form, text)
    assert worst(one.outputs, allowed) > 3.0, "uncorrected it is far from g"
    assert worst(apply(numbers, one.outputs), allowed) <= 1.0
    for name, change in MUTATIONS.items():
        if name == "transposed matrix" and one is diagonal:
            continue
        assert worst(apply(change(numbers), one.outputs), allowed) > 1.0, f"{form}: {name} would not be seen"


def test_imucal_and_our_functions_correct_it_in_their_own_code(whole: Chain, tmp_path: Path) -> None:
    from imucal.management import load_calibration_info

    allowed = FACTOR * whole.uncertainty
    (tmp_path / "c.json").write_text(whole.export("imucal"))
    by_imucal = load_calibration_info(tmp_path / "c.json", file_type="json")
    force, _ = by_imucal.calibrate(whole.outputs, np.zeros_like(whole.outputs), "m/s^2", "deg/s")
    assert worst(force, allowed) <= 1.0
    turned = json.loads(whole.export("imucal"))
    turned["b_a"] = [-x for x in turned["b_a"]]
    (tmp_path / "w.json").write_text(json.dumps(turned))
    wrong, _ = load_calibration_info(tmp_path / "w.json", file_type="json").calibrate(
        whole.outputs, np.zeros_like(whole.outputs), "m/s^2", "deg/s"
    )
    assert worst(wrong, allowed) > 1.0
    (tmp_path / "c.py").write_text(whole.export("python"))
    in_python = runpy.run_path(str(tmp_path / "c.py"))["correct_accelerometer"]
    assert worst(np.array([in_python(row) for row in whole.outputs]), allowed) <= 1.0


@pytest.mark.skipif(CC is None, reason="no C compiler here")
def test_the_c_function_corrects_it(whole: Chain, tmp_path: Path) -> None:
    (tmp_path / "calibration.h").write_text(whole.export("c"))
    (tmp_path / "run.c").write_text(
        '#include <stdio.h>\n#include "calibration.h"\n'
        "int main(void) { double u[3]; while (fread(u, 8, 3, stdin) == 3) { correct_accelerometer(u, u);"
        " fwrite(u, 8, 3, stdout); } return 0; }\n"
    )
    subprocess.run([str(CC), "-std=c99", "-o", "run", "run.c"], cwd=tmp_path, check=True)
    given = whole.outputs.astype("<f8").tobytes()
    out = subprocess.run([str(tmp_path / "run")], input=given, capture_output=True, check=True).stdout
    found = np.array(struct.unpack(f"<{whole.outputs.size}d", out)).reshape(-1, 3)
    assert worst(found, FACTOR * whole.uncertainty) <= 1.0


def test_the_noise_found_is_the_noise_made_and_reaches_kalibr(whole: Chain) -> None:
    """60 000 white samples give N to 1/√(2·60 000) = 0.3 %; the estimator shares it with four others, 3 % is ample."""
    read = yaml.safe_load(whole.export("kalibr-imu"))
    assert whole.random_walk == pytest.approx(SD / RATE_HZ**0.5, rel=0.03)
    assert read["accelerometer_noise_density"] == pytest.approx(SD / RATE_HZ**0.5, rel=0.03)
    assert read["gyroscope_noise_density"] == pytest.approx(GYRO_SD / RATE_HZ**0.5, rel=0.03)
    assert read["update_rate"] == RATE_HZ
