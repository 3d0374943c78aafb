"""Noise of imported recordings through REST: a real one end to end, and every flaw that makes a number unbelievable."""

import gzip
from collections.abc import Callable, Generator
from pathlib import Path
from typing import Any

import allantools
import numpy as np
import pytest

from bench_service.cli.asking.client import connect
from bench_service.settings import Settings
from tests.service.client import Client
from tests.service.page import drawn

AXES = "xyz"
MPU6050 = {
    "unit": "MPU6050-2",
    "rate_hz": 100.0,
    "header_lines": 4,
    "channels": [
        {"name": f"{kind}_{axis}", "quantity": quantity, "unit": "count", "column": f"{letter}{axis}"}
        for kind, quantity, letter in (("accelerometer", "specific_force", "a"), ("gyro", "angular_rate", "g"))
        for axis in AXES
    ],
}
RATE_HZ = 100.0
ONE = {
    "unit": "ONE",
    "rate_hz": RATE_HZ,
    "channels": [{"name": "gyro_x", "quantity": "angular_rate", "unit": "count", "column": "g"}],
}


@pytest.fixture(scope="module")
def client(tmp_path_factory: pytest.TempPathFactory) -> Generator[Client]:
    """A service that drives no bench: none is needed."""
    url = f"sqlite:///{tmp_path_factory.mktemp('noise') / 'bench.sqlite'}"
    with connect(Settings(database_url=url), None, drive=False) as http:
        yield Client(http)


@pytest.fixture(scope="module")
def result(client: Client, shared_data: Path) -> dict[str, Any]:
    file = (shared_data / "mpu6050_static" / "static_449s.csv.gz").read_bytes()
    recording = client.import_files(MPU6050, file)
    assert recording.status_code == 201, recording.text
    answer = client.analyse("noise_analysis", recordings=[recording.json()["id"]], parameters={"cell_s": 0.1})
    assert answer.status_code == 201, answer.text
    return answer.json()


@pytest.mark.shared_data
def test_a_real_unit_at_rest_is_analysed_end_to_end(client: Client, result: dict[str, Any], shared_data: Path) -> None:
    """Its random walk by the likelihood is the Allan deviation at 1 s by another implementation, where white rules."""
    text = gzip.decompress((shared_data / "mpu6050_static" / "static_449s.csv.gz").read_bytes()).decode()
    names = [c["column"] for c in MPU6050["channels"]]  # type: ignore[index]
    lines = text.splitlines()[4:]
    header = [name.strip() for name in lines[0].split(",")]
    table = np.loadtxt(lines[1:], delimiter=",", usecols=[header.index(n) for n in names])
    (launch,) = result["document"]["launches"]
    for column, channel in enumerate(launch["channels"]):
        assert channel["rate_unit"] == "count"
        coefficients = {c["process"]: c for c in channel["coefficients"]}
        walk = coefficients["random_walk"]["likelihood"]
        assert walk["value"] is not None
        (_, (at_1_s,), _, _) = allantools.oadev(table[:, column], RATE_HZ, "freq", [1.0])
        # σ(1 s)² holds B² and K² beside N², and has at least 449 degrees of freedom: 3.3 % one sigma
        assert 0.6 * at_1_s < walk["value"] < at_1_s * (1.0 + 4.0 / np.sqrt(2.0 * 449.0))
    page = client.http.get(result["page"]).text
    assert drawn(client, page) >= 2 * 6
    assert "resolution is 4 counts" in page  # of the accelerometers, which is true of this file


def stuck_bit(x: np.ndarray) -> np.ndarray:
    return x | 8


def saturated(x: np.ndarray) -> np.ndarray:
    return np.clip(x, -40, 45)


def constant(x: np.ndarray) -> np.ndarray:
    return np.full_like(x, 7)


def hung(x: np.ndarray) -> np.ndarray:
    return np.concatenate([x[:20_000], np.repeat(x[20_000], 200), x[20_200:]])


@pytest.mark.parametrize(
    ("flaw", "words"),
    [
        (constant, "reads 7 throughout"),
        (saturated, "saturated"),
        (stuck_bit, "bit 3 (of 8 counts) is stuck at 1"),
        (hung, "the data link seems to have stalled"),
    ],
)
def test_a_flaw_is_refused_in_a_sentence(client: Client, flaw: Callable[[np.ndarray], np.ndarray], words: str) -> None:
    good = np.round(np.random.default_rng(3).normal(0.0, 30.0, 40_000)).astype(np.int64)
    refusal = analysed(client, flaw(good))
    assert refusal.status_code == 422
    assert "channel gyro_x" in refusal.json()["detail"] or "rows in a row" in refusal.json()["detail"]
    assert words in refusal.json()["detail"]


def test_too_short_is_refused_with_what_is_needed(client: Client) -> None:
    refusal = analysed(client, np.arange(10) % 3)
    assert refusal.status_code == 422
    assert "10 samples are less than one cell of 1 s" in refusal.json()["detail"]
    refusal = analysed(client, np.random.default_rng(1).integers(-30, 30, 5000))
    assert "at least 120 are needed" in refusal.json()["detail"]


def test_what_is_no_number_or_no_even_time_does_not_come_in(client: Client) -> None:
    rows = [f"{k / RATE_HZ:.2f},{k % 7}" for k in range(1000)]
    timed = {**ONE, "time_column": "t"}
    for row, words in (("5.00,nan", "'nan' where a finite number"), ("5.30,3", "does not grow: 5.3 s in row 501")):
        bad = "\n".join(["t,g", *rows[:500], row, *rows[501:], ""]).encode()
        answer = client.import_files(timed, bad)
        assert answer.status_code == 422
        assert words in answer.json()["detail"]


def test_a_wrong_unit_is_told_from_gravity(client: Client) -> None:
    """Three accelerometers that read 1 say g, not m/s²."""
    x = np.random.default_rng(5).normal((0.0, 1.0, 0.0), 1e-3, (20_000, 3))
    lines = "\n".join(["x,y,z", *(",".join(f"{v:.6f}" for v in row) for row in x), ""])
    channels = [
        {"name": f"accelerometer_{axis}", "quantity": "specific_force", "unit": "m/s^2", "column": axis}
        for axis in AXES
    ]
    recording = client.import_files({"unit": "G", "rate_hz": RATE_HZ, "channels": channels}, lines.encode())
    refusal = client.analyse("noise_analysis", recordings=[recording.json()["id"]])
    assert refusal.status_code == 422
    assert "g" in refusal.json()["detail"]
    assert "accelerometer" in refusal.json()["detail"]


def analysed(client: Client, counts: np.ndarray) -> Any:
    body = "\n".join(["g", *(str(int(v)) for v in counts), ""]).encode()
    recording = client.import_files(ONE, body)
    assert recording.status_code == 201, recording.text
    return client.analyse("noise_analysis", recordings=[recording.json()["id"]])
