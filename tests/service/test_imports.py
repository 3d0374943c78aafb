"""Imports over HTTP: what was found is told by API, page and command; bodies are bounded before they are spooled."""

import json
import re
from collections.abc import Iterator
from pathlib import Path
from types import SimpleNamespace
from typing import Any, cast

import httpx
import numpy as np
import pytest

from bench_service.cli.asking.client import connect
from bench_service.cli.commands import run_command_line
from bench_service.evidence.analyses import AnalysisService
from bench_service.model.records import RecordingState, StoredRecording
from bench_service.settings import Settings
from bench_service.wall_clock import now
from procedures.core.recording import RecordingInfo, Station
from procedures.core.table_angles import TableAngles
from tests.service.client import Client

GYRO = {"name": "gyro_x", "column": "x", "quantity": "angular_rate", "unit": "deg/s"}
DESCRIPTION = {"unit": "IMPORTED-1", "time_column": "t", "channels": [GYRO], "repeats": "drop", "gaps": "mark"}
ROWS = [i for i in range(600) if i not in (200, 201)]
FILE = b"t,x\n" + b"".join(b"%.2f,%d.5\n" % (i / 100, i % 17) for i in sorted([*ROWS, 50]))
SAID = ("1 row repeats the row before", "2 samples are missing in 1 place: 2 between rows 201 and 202")


def _sent(data: bytes, boundary: str = "parted") -> tuple[bytes, dict[str, str]]:
    """A form as a client sends it."""
    parts = (
        f'--{boundary}\r\nContent-Disposition: form-data; name="description"\r\n\r\n{json.dumps(DESCRIPTION)}\r\n'
        f'--{boundary}\r\nContent-Disposition: form-data; name="files"; filename="a.csv"\r\n\r\n'
    )
    body = parts.encode() + data + f"\r\n--{boundary}--\r\n".encode()
    return body, {"Content-Type": f"multipart/form-data; boundary={boundary}"}


def test_findings_are_warnings_of_the_recording(sqlite_client: Client) -> None:
    answer = sqlite_client.import_files(DESCRIPTION, FILE)
    assert answer.status_code == 201, answer.text
    made = answer.json()
    assert (made["rate_hz"], made["count"]) == (pytest.approx(100.0), 600)
    for said in SAID:
        assert any(said in warning for warning in made["warnings"])
    assert made["source"]["clock"]["lost_samples"] == 2
    assert made["channels"][0]["unit"] == "rad/s"
    again = sqlite_client.http.get(f"/api/v1/recordings/{made['id']}").json()
    assert again["warnings"] == made["warnings"]
    page = sqlite_client.http.get("/units/IMPORTED-1").text
    assert made["id"] in page
    for said in SAID:
        assert said in page
    refused = sqlite_client.analyse("allan_deviation", recordings=[made["id"]])
    assert refused.status_code == 422
    assert "2 of 600 samples (0.333 %) are not a finite number, the first is sample 200" in refused.json()["detail"]
    left_out = sqlite_client.analyse("allan_deviation", recordings=[made["id"]], parameters={"gaps": "leave_out"})
    assert left_out.status_code == 201, left_out.text
    assert any("2 of 600 samples" in warning for warning in left_out.json()["document"]["warnings"])


def test_the_command_says_them_to_standard_error(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    file, description = tmp_path / "a.csv", tmp_path / "a.json"
    file.write_bytes(FILE)
    description.write_text(json.dumps(DESCRIPTION))
    settings = Settings(database_url=f"sqlite:///{tmp_path / 'bench.sqlite'}")
    assert run_command_line(settings, ["import", str(file), "--description", str(description)]) == 0
    said = capsys.readouterr()
    assert re.fullmatch(r"recording \S+ of unit \S+: 600 samples of \d+ channels, \S+ Hz, \S+ s\n", said.out)
    assert "warning: 1 row repeats the row before" in said.err


@pytest.fixture(scope="module")
def small(tmp_path_factory: pytest.TempPathFactory) -> Iterator[httpx.Client]:
    folder = tmp_path_factory.mktemp("small")
    with connect(
        Settings(database_url=f"sqlite:///{folder / 'bench.sqlite'}", max_import_mb=0.5), None, drive=False
    ) as http:
        yield http


def test_a_body_that_is_announced_too_long_is_refused_before_it_comes(small: httpx.Client) -> None:
    body, headers = _sent(b"1\n" * 900_000)
    came = 0

    def pieces() -> Iterator[bytes]:
        nonlocal came
        for start in range(0, len(body), 10_000):
            came += 10_000
            yield body[start : start + 10_000]

    try:
        answer = small.post(
            "/api/v1/recordings", content=pieces(), headers={**headers, "Content-Length": str(len(body))}
        )
        assert answer.status_code == 413
        assert answer.json()["errors"][0]["message"] == "at most 1500000 bytes are accepted"
    except httpx.WriteError:
        assert came < len(body)  # the line was closed while it was still sending


def test_a_body_that_turns_out_too_long_is_refused_as_it_comes(small: httpx.Client) -> None:
    body, headers = _sent(b"1\n" * 900_000)
    try:
        answer = small.post("/api/v1/recordings", content=iter([body[:900_000], body[900_000:]]), headers=headers)
        assert answer.status_code == 413
    except httpx.WriteError:
        pass
    assert small.get("/healthz").status_code == 200
    assert small.get("/api/v1/recordings").json()["items"] == []


def test_files_beside_their_description_are_bounded_themselves(small: httpx.Client) -> None:
    body, headers = _sent(b"1\n" * 300_000)
    answer = small.post("/api/v1/recordings", content=body, headers=headers)
    assert answer.status_code == 422
    assert "at most 500000 bytes" in answer.json()["detail"]


METHODS = {
    "noise_analysis": {},
    "scalar_calibration": {"gravity_m_s2": 9.8},
    "kalman_calibration": {},
}


@pytest.mark.parametrize("method", METHODS)
def test_no_other_method_takes_a_gap_for_a_number(sqlite_client: Client, method: str) -> None:
    rng = np.random.Generator(np.random.PCG64(5))
    values = np.concatenate(
        [rng.normal(0.0, 1e-3, (3000, 3)), rng.normal(0.0, 0.01, (3000, 3)) + np.array([0, 0, 9.8])], axis=1
    )
    lines = [",".join(f"{v:.6f}" for v in row) for row in values]
    lines[1500] = ",,,,,"
    names = [f"{kind}_{axis}" for kind in ("gyro", "accelerometer") for axis in "xyz"]
    units = {"gyro": ("angular_rate", "rad/s"), "accelerometer": ("specific_force", "m/s^2")}
    channels = [
        {"name": n, "quantity": units[n.partition("_")[0]][0], "unit": units[n.partition("_")[0]][1]} for n in names
    ]
    data = "\n".join([",".join(names), *lines]).encode()
    description = {"unit": "GAPS-1", "rate_hz": 100.0, "channels": channels, "gaps": "mark"}
    made = sqlite_client.import_files(description, data)
    assert made.status_code == 201, made.text
    answer = sqlite_client.analyse(method, recordings=[made.json()["id"]], parameters=METHODS[method])
    assert answer.status_code == 422, answer.text
    said = answer.json()["detail"]
    assert any(word in said for word in ("1500", "not numbers", "NaN", "missing", "finite")), said


def test_texts_of_a_result_name_the_recordings_by_their_files_or_job_and_station(sqlite_client: Client) -> None:
    """They said "recording 1", and of two jobs "position 1" twice."""
    rng = np.random.default_rng(18)
    description = {
        "unit": "NAMED-1",
        "rate_hz": 10.0,
        "channels": [{"name": "gyro_x", "quantity": "angular_rate", "unit": "rad/s"}],
    }
    data = "gyro_x\n" + "\n".join(f"{value:.9f}" for value in rng.normal(0.0, 1e-4, 1500))
    other = "gyro_x\n" + "\n".join(f"{value:.9f}" for value in rng.normal(0.0, 1e-4, 1500))
    ids = [sqlite_client.import_files(description, each.encode()).json()["id"] for each in (data, other)]
    alone = sqlite_client.analyse("noise_analysis", recordings=ids[:1])
    assert alone.status_code == 201, alone.text
    assert [launch["label"] for launch in alone.json()["document"]["launches"]] == ["file0.csv"]
    both = sqlite_client.analyse("noise_analysis", recordings=ids)
    labels = [launch["label"] for launch in both.json()["document"]["launches"]]
    assert labels == [f"file0.csv ({one[:8]})" for one in ids]
    page = sqlite_client.http.get(both.json()["page"]).text
    assert (labels[0] in page, "recording 1" in page) == (True, False)


def test_recordings_of_several_jobs_are_named_by_job_and_station() -> None:
    station = Station(0, "position 1", TableAngles(0.0, 0.0, 0.0), 20.5, 1.0, 60.0)
    infos = [RecordingInfo(f"r{number}", "U-1", (), 100.0, 10, station=station) for number in range(3)]
    jobs = ("a", "b", None)
    stored = {i.id: StoredRecording(i, RecordingState.COMPLETE, now(), job) for i, job in zip(infos, jobs, strict=True)}
    loaded: dict[str, str] = {}
    recordings = SimpleNamespace(get=stored.__getitem__, load=loaded.__setitem__)
    job_of = lambda job_id: SimpleNamespace(number={"a": 7, "b": 12}[job_id])  # noqa: E731
    service = AnalysisService(
        cast("Any", SimpleNamespace(recordings=recordings)), cast("Any", None), cast("Any", job_of), ""
    )
    service._complete(["r0", "r1", "r2"])
    assert loaded == {"r0": "job #7, position 1", "r1": "job #12, position 1", "r2": ""}
    service._complete(["r0"])
    assert loaded["r0"] == "", "of one job alone the station says enough"
