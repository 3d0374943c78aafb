"""From a foreign log to a consumer, the gyros: import, noise, calibration, export, and the rate of known turns.

The unit is made here: ``U = b + K·v + n`` with b, K, n known to nobody else; it stood at known table angles, turned by
matrices that are written out here from the conventions of `procedures`. A consumer's correction is written from its own
documents, or is its own code. The vector of the rate is compared, not its size: a wrong sign, order or frame shows.
"""

import json
import runpy
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from math import cos, radians, sin
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
from tests.kit.logged_unit import RATE_HZ, declare_noise, exported, found_noise, imported
from tests.service.client import Client

G, LATITUDE, EARTH = 9.81, 50.0, 7.292115e-5
STAND_S, STANDS = 4.0, 12
SD = {"gyro": 1e-7, "accelerometer": 1e-4}
"""White noise of a sample [rad/s], [m/s²]. Twelve stands of 400 samples give K of the gyros by the Earth's rate to
about ``1e-7/20/7.3e-5/√(12/3) = 3e-5``; its cross-couplings and scale errors are 1e-2."""
TURN = 0.5
"""Rate of the known turns [rad/s]."""
FACTOR = 4.0
"""Standard uncertainties within which a corrected rate must be: the length of a vector of three normal components
exceeds four times the root of the sum of their variances with a chance of 1e-9 (equal ones) to 6e-5 (one alone)."""
UNIT = "CHAIN-G"


def attitude(outer: float, middle: float, inner: float) -> np.ndarray:
    """rot_rb = R_y(outer)·R_z(middle)·R_x(inner), angles in degrees."""
    (a, b, c), (d, e, f) = ([fn(radians(x)) for x in (outer, middle, inner)] for fn in (cos, sin))
    about_y = np.array([[a, 0, d], [0, 1, 0], [-d, 0, a]])
    about_z = np.array([[b, -e, 0], [e, b, 0], [0, 0, 1]])
    about_x = np.array([[1, 0, 0], [0, c, -f], [0, f, c]])
    return about_y @ about_z @ about_x


def earth(angles: tuple[float, float, float]) -> np.ndarray:
    """Earth's rate in the unit's axes: north, up, east is the reference at azimuth zero."""
    return attitude(*angles).T @ (EARTH * np.array([cos(radians(LATITUDE)), sin(radians(LATITUDE)), 0.0]))


@dataclass(frozen=True)
class Made:
    """The unit that was made: b and K of each triad."""

    b: dict[str, np.ndarray]
    k: dict[str, np.ndarray]
    rng: np.random.Generator

    @classmethod
    def of(cls, seed: int) -> "Made":
        rng = np.random.Generator(np.random.PCG64(seed))
        b = {
            t: size * rng.uniform(0.5, 1.0, 3) * rng.choice([-1, 1], 3)
            for t, size in (("gyro", 1e-3), ("accelerometer", 0.08))
        }
        return cls(b, {t: np.eye(3) + rng.uniform(-0.01, 0.01, (3, 3)) for t in b}, rng)

    def out(self, triad: str, v: np.ndarray, n: int) -> np.ndarray:
        return self.b[triad] + self.k[triad] @ v + SD[triad] * self.rng.normal(size=(n, 3))

    def stand(self, angles: tuple[float, float, float], n: int) -> np.ndarray:
        force = attitude(*angles).T @ np.array([0.0, G, 0.0])
        return np.hstack([self.out("accelerometer", force, n), self.out("gyro", earth(angles), n)])


@dataclass(frozen=True)
class Chain:
    """The unit after import, noise and calibration, with its exports and outputs of known rates."""

    client: Client
    gyro: str
    force: str
    rates: np.ndarray
    """Known rates, (n, 3) [rad/s]: Earth's at new attitudes, then turns."""
    outputs: np.ndarray

    def export(self, form: str) -> str:
        return exported(self.client, UNIT, self.force, self.gyro, form)

    @property
    def allowed(self) -> np.ndarray:
        """Length of an error that is allowed at each known rate, by the covariance in our JSON and the noise made.

        ω = K⁻¹(U − b), so dω = −K⁻¹(db + dK·ω) + K⁻¹·n: its derivative by (b_i, K_ij) is −(K⁻¹)_pi·(1, ω_j).
        """
        (one,) = [t for t in json.loads(self.export("json"))["triads"] if t["triad"] == "gyro"]
        inverse, covariance = np.linalg.inv(one["forward"]["K"]), np.array(one["covariance"]["matrix"])
        extended = np.column_stack([np.ones(len(self.rates)), self.rates])
        gradient = np.einsum("pi,nj->npij", inverse, extended).reshape(len(self.rates), 3, 12)
        variance = np.einsum("npk,kl,npl->n", gradient, covariance, gradient)
        return FACTOR * np.sqrt(variance + (inverse**2).sum() * SD["gyro"] ** 2 / (STAND_S * RATE_HZ))


@pytest.fixture(scope="module")
def chain(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Chain]:
    file = tmp_path_factory.mktemp("gyros") / "bench.sqlite"
    made, n = Made.of(5), int(STAND_S * RATE_HZ)
    angles = [tuple(float(x) for x in row) for row in made.rng.integers(-180, 180, (STANDS, 3))]
    new = [tuple(float(x) for x in row) for row in made.rng.integers(-180, 180, (6, 3))]
    with connect(Settings(database_url=f"sqlite:///{file}"), None, drive=False) as http:
        client = Client(http)
        still = imported(client, UNIT, made.stand((0.0, 0.0, 0.0), 13_000))
        declare_noise(client, UNIT, found_noise(client, still))
        stands = [imported(client, UNIT, made.stand(a, n)) for a in angles]
        site = {"gravity_m_s2": G, "latitude_deg": LATITUDE, "positions": angles}
        answer = client.analyse("multi_position_calibration_of_recordings", recordings=stands, parameters=site)
        assert (answer.status_code, answer.json()["verdict"]) == (201, "pass"), answer.text
        of = {c["triad"]: c["id"] for c in http.get(f"/api/v1/units/{UNIT}/calibrations").json()["items"]}
        turns = TURN * np.vstack([np.eye(3), -np.eye(3), np.full((1, 3), 3**-0.5)])
        rates = np.vstack([[earth(a) for a in new], turns])
        outputs = np.stack([made.out("gyro", v, n).mean(axis=0) for v in rates])
        yield Chain(client, of["gyro"], of["accelerometer"], rates, outputs)


BIAS = "gyro bias [rad/s]"
"""Words of the comment that has it. The frame of `Numbers` takes the unit's axes to the consumer's."""


def by_kalibr(text: str) -> Numbers:
    """Kalibr, scale-misalignment: ω_m = M·C_gyro_i·ω_i; the bias stands in a comment."""
    read = yaml.safe_load(text)["imu0"]
    matrix = np.array(read["gyroscopes"]["M"]) @ np.array(read["gyroscopes"]["C_gyro_i"])
    return {"offset": commented_bias(text, BIAS), "matrix": matrix, "frame": np.array(read["R_imu_from_unit"])}


def by_openvins(text: str) -> Numbers:
    """OpenVINS, model kalibr: ω_m = Tw·R_IMUtoGYRO·ω_I, of Tw the lower triangle."""
    read = yaml.safe_load(text.removeprefix("%YAML:1.0\n"))["imu0"]
    matrix = np.tril(np.array(read["Tw"])) @ np.array(read["R_IMUtoGYRO"])
    return {"offset": commented_bias(text, BIAS), "matrix": matrix, "frame": np.array(read["R_imu_from_unit"])}


def by_matlab(text: str) -> Numbers:
    """MATLAB: C = U·A + b on rows, so K = (Aᵀ)⁻¹ and the offset is −K·b."""
    found = assigned(text)
    matrix = np.linalg.inv(found["A_gyro"].T)
    return {"offset": -matrix @ found["b_gyro"].ravel(), "matrix": matrix, "frame": np.eye(3)}


def by_psins(text: str) -> Numbers:
    """PSINS: ω_out = (I + dKg)·ω + eb; dKGij in the order yx, zx, zy, xy, xz, yz."""
    found = assigned(text)
    matrix = np.eye(3) + np.diag(found["dKGii"].ravel())
    places = [(1, 0), (2, 0), (2, 1), (0, 1), (0, 2), (1, 2)]
    for (i, j), value in zip(places, found["dKGij"].ravel(), strict=True):
        matrix[i, j] = value
    return {"offset": found["eb"].ravel(), "matrix": matrix, "frame": found["Q"]}


def by_ardupilot(text: str) -> Numbers:
    """ArduPilot: raw − INS_GYROFFS of each axis; it has no scale of gyros."""
    read = of_ardupilot(text)
    return _offsets([read[f"INS_GYROFFS_{axis}"] for axis in "XYZ"])


def by_px4(text: str) -> Numbers:
    """PX4: raw − OFF of each axis; it has no scale of gyros."""
    read = of_px4(text)
    return _offsets([read[f"CAL_GYRO0_{axis}OFF"] for axis in "XYZ"])


def _offsets(values: list[float]) -> Numbers:
    return {"offset": np.array(values), "matrix": np.eye(3), "frame": np.eye(3)}


def errors(numbers: Numbers, chain: Chain) -> np.ndarray:
    """Length of each corrected rate's error [rad/s], in the consumer's frame."""
    found = np.linalg.solve(numbers["matrix"], (chain.outputs - numbers["offset"]).T).T
    return np.linalg.norm(found - chain.rates @ numbers["frame"].T, axis=1)


def worst(numbers: Numbers, chain: Chain, allowed: np.ndarray) -> float:
    return float(np.max(errors(numbers, chain) / allowed))


WHOLE = {"kalibr": by_kalibr, "openvins": by_openvins, "matlab": by_matlab, "psins": by_psins}
OFFSETS = {"ardupilot": by_ardupilot, "px4": by_px4}


@pytest.mark.parametrize("form", list(WHOLE))
def test_known_rates_come_back_after_the_consumer_s_correction_and_not_after_a_wrong_one(
    form: str, chain: Chain
) -> None:
    numbers, allowed = WHOLE[form](chain.export(form)), chain.allowed
    assert worst({**numbers, "offset": np.zeros(3), "matrix": np.eye(3)}, chain, allowed) > 3.0, "uncorrected"
    assert worst(numbers, chain, allowed) <= 1.0
    wrong: dict[str, Callable[[Numbers], Numbers]] = {**OF_THE_OFFSET, **OF_THE_MATRIX}
    if not np.allclose(numbers["frame"], np.eye(3)):
        wrong["the frame left out"] = lambda n: {**n, "frame": np.eye(3)}
    for name, change in wrong.items():
        assert worst(change(numbers), chain, allowed) > 1.0, f"{form}: {name} would not be seen"


@pytest.mark.parametrize("form", list(OFFSETS))
def test_an_autopilot_takes_the_bias_off_within_the_loss_that_its_file_states(form: str, chain: Chain) -> None:
    """The loss is stated at 100 deg/s on every axis, and is linear in the rate: its share at a rate |ω| is allowed."""
    text = chain.export(form)
    loss = stated_loss(text, "lost: scale factors and cross terms of the gyros")
    share = np.abs(chain.rates).max(axis=1) / radians(100.0)
    allowed = chain.allowed + loss * share
    numbers = OFFSETS[form](text)
    assert worst({**numbers, "offset": np.zeros(3)}, chain, allowed) > 3.0, "uncorrected"
    assert worst(numbers, chain, allowed) <= 1.0
    for name, change in OF_THE_OFFSET.items():
        assert worst(change(numbers), chain, allowed) > 1.0, f"{form}: {name} would not be seen"


def test_imucal_and_our_function_correct_the_gyros_in_their_own_code(chain: Chain, tmp_path: Path) -> None:
    from imucal.management import load_calibration_info

    def by_imucal(text: str) -> np.ndarray:
        (tmp_path / "c.json").write_text(text)
        read = load_calibration_info(tmp_path / "c.json", file_type="json")
        still = np.zeros_like(chain.outputs)
        return np.radians(read.calibrate(still, np.degrees(chain.outputs), "m/s^2", "deg/s")[1])

    def far(found: np.ndarray) -> float:
        return float(np.max(np.linalg.norm(found - chain.rates, axis=1) / chain.allowed))

    text = chain.export("imucal")
    assert far(by_imucal(text)) <= 1.0
    wrong = json.loads(text)
    wrong["b_g"] = [-x for x in wrong["b_g"]]
    assert far(by_imucal(json.dumps(wrong))) > 1.0
    (tmp_path / "c.py").write_text(chain.export("python"))
    function = runpy.run_path(str(tmp_path / "c.py"))["correct_gyro"]
    assert far(np.array([function(row) for row in chain.outputs])) <= 1.0
