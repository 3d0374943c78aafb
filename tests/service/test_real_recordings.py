"""Real recordings through the service: in from their files, analysed, held against others' results, and out again."""

import io
from collections.abc import Generator
from pathlib import Path
from typing import Any

import httpx
import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest

from bench_service.cli.asking.client import connect
from bench_service.settings import Settings
from tests.service.client import Client
from tests.service.page import drawn

pytestmark = [pytest.mark.shared_data, pytest.mark.timeout(120)]

AXES = "xyz"
ACCELEROMETER = [f"accelerometer_{axis}" for axis in AXES]
GYRO = [f"gyro_{axis}" for axis in AXES]


def counts(names: list[str], quantity: str, columns: list[Any], file: int = 0) -> list[dict[str, Any]]:
    """Channels whose scale is not known."""
    return [
        {"name": name, "quantity": quantity, "unit": "count", "column": column, "file": file}
        for name, column in zip(names, columns, strict=True)
    ]


XSENS = {
    "unit": "XSENS-1",
    "rate_hz": 100.0,
    "time_column": 0,
    "header": False,
    "delimiter": "whitespace",
    "channels": counts(ACCELEROMETER, "specific_force", [1, 2, 3]) + counts(GYRO, "angular_rate", [1, 2, 3], file=1),
}
MPU6050 = {
    "unit": "MPU6050-1",
    "rate_hz": 100.0,
    "header_lines": 4,
    "channels": counts(ACCELEROMETER, "specific_force", ["ax", "ay", "az"])
    + counts(GYRO, "angular_rate", ["gx", "gy", "gz"]),
}


@pytest.fixture(scope="module")
def client(tmp_path_factory: pytest.TempPathFactory, shared_data: Path) -> Generator[Client]:
    """A service that drives no bench: none is needed."""
    url = f"sqlite:///{tmp_path_factory.mktemp('real') / 'bench.sqlite'}"
    with connect(Settings(database_url=url), None, drive=False) as http:
        yield Client(http)


@pytest.fixture(scope="module")
def xsens_files(shared_data: Path) -> tuple[bytes, bytes]:
    folder = shared_data / "xsens_multi_position"
    return (folder / "xsens_acc.txt.gz").read_bytes(), (folder / "xsens_gyro.txt.gz").read_bytes()


@pytest.fixture(scope="module")
def xsens(client: Client, xsens_files: tuple[bytes, bytes]) -> dict[str, Any]:
    """Accelerometers and gyros of one unit, joined from two files."""
    answer = client.import_files(XSENS, *xsens_files, key="xsens")
    assert answer.status_code == 201, answer.text
    return answer.json()


@pytest.fixture(scope="module")
def xsens_raw(shared_data: Path) -> np.ndarray:
    """The same samples, read without the service."""
    folder = shared_data / "xsens_multi_position"
    return np.column_stack([np.loadtxt(folder / f"xsens_{kind}.txt.gz")[:, 1:] for kind in ("acc", "gyro")])


@pytest.fixture(scope="module")
def xsens_result(client: Client, xsens: dict[str, Any]) -> dict[str, Any]:
    answer = client.analyse("scalar_calibration", recordings=[xsens["id"]], parameters={"gravity_m_s2": 9.81744})
    assert answer.status_code == 201, answer.text
    return answer.json()


def estimates(result: dict[str, Any]) -> tuple[np.ndarray, np.ndarray]:
    """The nine parameters and their standard uncertainties."""
    parameters = result["document"]["parameters"]
    found, sd = (np.array([p[key] for p in parameters]) for key in ("estimate", "standard_uncertainty"))
    return found, sd


def test_two_files_become_one_recording_that_knows_where_it_came_from(xsens: dict[str, Any]) -> None:
    assert (xsens["count"], xsens["rate_hz"], xsens["simulated"], xsens["job"]) == (51_175, 100.0, False, None)
    assert [c["name"] for c in xsens["channels"]] == ACCELEROMETER + GYRO
    assert {c["unit"] for c in xsens["channels"]} == {"count"}
    assert [f["name"] for f in xsens["source"]["files"]] == ["file0.csv", "file1.csv"]
    assert all(len(f["sha256"]) == 64 for f in xsens["source"]["files"])
    assert xsens["source"]["description"]["unit"] == "XSENS-1"
    assert xsens["stored_bytes"] < 2.5 * 6 * xsens["count"]


def test_xsens_agrees_with_the_reference_within_two_standard_errors(
    xsens_result: dict[str, Any], shared_data: Path
) -> None:
    # imu_tk's .calib: T upper triangular with the sign as it stands, scale, bias; correct = T·K·(raw − bias).
    words = (shared_data / "xsens_multi_position" / "reference_04_imu_tk_test_imu_acc.calib").read_text().split()
    t, k, bias = np.array(words[:9], float), np.array(words[9:18], float), np.array(words[18:], float)
    reference = np.array([*bias, *k[[0, 4, 8]], t[1], t[2], t[5]])
    found, sd = estimates(xsens_result)
    assert np.abs((found - reference) / sd).max() < 2.0
    assert (sd[3:6] / found[3:6]).max() < 2e-4
    assert xsens_result["document"]["poses"] == 38
    assert xsens_result["verdict"] == "pass"
    assert not any("undetermined" in w for w in xsens_result["document"]["warnings"])


def test_ten_poses_of_an_mpu6050_give_scale_and_bias_and_admit_the_rest(client: Client, shared_data: Path) -> None:
    folder = shared_data / "mpu6050_static"
    imported = client.import_files(MPU6050, (folder / "ten_positions.csv.gz").read_bytes())
    assert imported.status_code == 201, imported.text
    recording = imported.json()["id"]
    answer = client.analyse("scalar_calibration", recordings=[recording], parameters={"gravity_m_s2": 9.80665})
    found, sd = estimates(answer.json())
    reference = np.loadtxt(folder / "optmization_result_data_params_acc.csv")
    assert found[3:6] == pytest.approx(reference[3:6], rel=0.005)
    assert found[:3] == pytest.approx(-reference[6:], rel=0.05)  # its bias is added, ours is subtracted
    assert answer.json()["document"]["poses"] == 10
    assert sd[6] > 0.01  # rad: one misalignment is as good as unknown, …
    warnings = answer.json()["document"]["warnings"]
    assert any("t_xy is practically undetermined" in w for w in warnings)  # … and the result says so
    page = client.http.get(answer.json()["page"]).text
    assert "t_xy is practically undetermined" in page


def test_lineage_leads_from_the_samples_to_the_numbers_and_back(
    client: Client, xsens: dict[str, Any], xsens_result: dict[str, Any]
) -> None:
    lineage = xsens_result["lineage"]
    assert lineage["recordings"] == [{"id": xsens["id"], "content_hash": xsens["content_hash"]}]
    assert lineage["parameters"]["gravity_m_s2"] == 9.81744
    assert (lineage["simulated"], lineage["seed"], lineage["job"]) == (False, None, None)
    assert lineage["code_version"] == client.http.get("/healthz").json()["code_version"]
    recording = client.http.get(f"/api/v1/recordings/{xsens['id']}").json()
    assert xsens_result["id"] in recording["results"]
    assert client.http.get(f"/api/v1/results/{xsens_result['id']}").json() == xsens_result
    calibrations = client.http.get("/api/v1/units/XSENS-1/calibrations").json()["items"]
    assert [c["result"] for c in calibrations] == [xsens_result["id"]]
    assert calibrations[0]["calibration"] == xsens_result["document"]["calibration"]


def test_the_result_has_a_page_with_its_verdict_and_a_plot(client: Client, xsens_result: dict[str, Any]) -> None:
    page = client.http.get(xsens_result["page"])
    assert (page.status_code, page.headers["content-type"]) == (200, "text/html; charset=utf-8")
    assert '<span class="badge pass">pass</span>' in page.text
    assert drawn(client, page.text) == 1
    assert xsens_result["lineage"]["code_version"] in page.text


def taken(client: Client, recording: dict[str, Any], form: str, **query: object) -> tuple[list[str], np.ndarray]:
    """Names and samples of a part that was taken out."""
    path = f"/api/v1/recordings/{recording['id']}/data"
    answer = client.http.get(path, params={"format": form, **query})
    assert answer.status_code == 200, answer.text
    return _read(form, answer)


def _read(form: str, answer: httpx.Response) -> tuple[list[str], np.ndarray]:
    if form == "csv":
        lines = [line for line in answer.text.splitlines() if not line.startswith("#")]
        table = np.loadtxt(io.StringIO("\n".join(lines[1:])), delimiter=",", ndmin=2)
        return lines[0].split(",")[1:], table[:, 1:]
    source = io.BytesIO(answer.content)
    table = pq.read_table(source) if form == "parquet" else pa.ipc.open_stream(source).read_all()
    return table.column_names, np.column_stack([table.column(name).to_numpy() for name in table.column_names])


@pytest.mark.parametrize("form", ["arrow", "parquet", "csv"])
def test_what_comes_out_is_what_went_in(
    client: Client, xsens: dict[str, Any], xsens_raw: np.ndarray, form: str
) -> None:
    names, samples = taken(client, xsens, form)
    assert names == ACCELEROMETER + GYRO
    np.testing.assert_array_equal(samples, xsens_raw)
    names, samples = taken(client, xsens, form, channels="gyro_z,accelerometer_x", start_s=100.005, stop_s=250.5)
    assert names == ["gyro_z", "accelerometer_x"]
    np.testing.assert_array_equal(samples, xsens_raw[10_001:25_050, [5, 0]])


def test_unit_scale_and_hash_travel_with_the_samples(client: Client, xsens: dict[str, Any]) -> None:
    path = f"/api/v1/recordings/{xsens['id']}/data"
    text = client.http.get(path, params={"format": "csv", "stop_s": 0.01}).text
    assert xsens["content_hash"] in text
    assert "# channel accelerometer_x: quantity=specific_force unit=count scale=1.0 offset=0.0" in text
    parquet = client.http.get(path, params={"format": "parquet", "stop_s": 0.01}).content
    schema = pq.read_schema(io.BytesIO(parquet))
    assert xsens["content_hash"].encode() in (schema.metadata or {}).values()


def test_an_import_sent_twice_is_one_recording_and_the_same_samples_have_the_same_hash(
    client: Client, xsens: dict[str, Any], xsens_files: tuple[bytes, bytes]
) -> None:
    again = client.import_files(XSENS, *xsens_files, key="xsens")
    assert (again.status_code, again.json()["id"]) == (201, xsens["id"])
    listed = client.http.get("/api/v1/recordings", params={"unit": "XSENS-1"}).json()["items"]
    assert [r["id"] for r in listed] == [xsens["id"]]
    another = client.import_files({**XSENS, "start_s": 5.0}, *xsens_files, key="xsens")
    assert another.status_code == 409
    copy = client.import_files({**XSENS, "unit": "XSENS-COPY"}, *xsens_files).json()
    assert copy["id"] != xsens["id"]
    assert copy["content_hash"] == xsens["content_hash"]
    less = {**XSENS, "unit": "XSENS-LESS", "channels": counts(ACCELEROMETER, "specific_force", [1, 2, 3])}
    assert client.import_files(less, xsens_files[0]).json()["content_hash"] != xsens["content_hash"]
