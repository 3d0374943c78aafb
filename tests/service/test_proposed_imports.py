"""A description is proposed over HTTP and by the command, and nothing is imported before a person has confirmed it."""

import json
from pathlib import Path

import pytest

from bench_service.cli.commands import run_command_line
from bench_service.settings import Settings
from tests.service.client import Client

NAMES = "#timestamp [ns]," + ",".join(
    f"{kind}_RS_S_{axis} [{unit}]" for kind, unit in (("w", "rad s^-1"), ("a", "m s^-2")) for axis in "xyz"
)
EUROC = (
    NAMES + "\n" + "".join(f"{10**18 + i * 5_000_000},{i % 3},1.5,-2.5,0.1,{i % 2},9.8\n" for i in range(300))
).encode()
UNSAID = ("t,wx,wy,wz\n" + "".join(f"{i / 100},{i % 3},1.5,-{i % 2}\n" for i in range(300))).encode()


def _describe(client: Client, data: bytes, name: str = "imu0.csv", **known: str) -> dict:
    answer = client.http.post("/api/v1/recordings/describe", files={"file": (name, data)}, data=known)
    assert answer.status_code == 200, answer.text
    return answer.json()


def test_a_proposed_description_imports_the_file(sqlite_client: Client) -> None:
    before = sqlite_client.stored()
    found = _describe(sqlite_client, EUROC, unit="EUROC-1")
    assert sqlite_client.stored() == before
    assert (found["format"], found["unknown"], found["rate_hz"]) == ("euroc", [], pytest.approx(200.0))
    made = sqlite_client.import_files(found["description"], EUROC)
    assert made.status_code == 201, made.text
    assert [c["name"] for c in made.json()["channels"]][3] == "accelerometer_x"


def test_what_is_not_known_is_said(sqlite_client: Client) -> None:
    found = _describe(sqlite_client, UNSAID)
    assert found["description"]["unit"] is None
    assert found["unknown"][0] == "unit: the serial of the unit"
    asked = next(words for words in found["unknown"] if "unit of the gyros (wx, wy, wz) is not said" in words)
    doubts = {column["channel"]: column["unit_doubt"] for column in found["columns"]}
    assert {channel for channel, doubt in doubts.items() if doubt == asked} == {"gyro_x", "gyro_y", "gyro_z"}


def test_a_file_that_cannot_be_described_is_refused_in_words(sqlite_client: Client) -> None:
    answer = sqlite_client.http.post("/api/v1/recordings/describe", files={"file": ("a.txt", b"words alone\n")})
    assert answer.status_code == 422
    assert "a.txt: no table of numbers is recognised" in answer.json()["detail"]
    wrong = sqlite_client.http.post(
        "/api/v1/recordings/describe", files={"file": ("a.txt", EUROC)}, data={"format": "word"}
    )
    assert wrong.status_code == 422
    assert "one of table, hdf5, mat5, ulog" in wrong.text


def test_the_command_describes_confirms_and_imports(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    settings = Settings(database_url=f"sqlite:///{tmp_path / 'bench.sqlite'}")
    good, bad = tmp_path / "imu0.csv", tmp_path / "unsaid.csv"
    good.write_bytes(EUROC)
    bad.write_bytes(UNSAID)
    assert run_command_line(settings, ["import", str(good), "--unit", "E-1", "--describe"]) == 0
    described = capsys.readouterr()
    assert json.loads(described.out)["time_unit"] == "ns"
    assert "EuRoC, 300 rows, 200 Hz" in described.err
    assert run_command_line(settings, ["import", str(good), "--unit", "E-1"]) == 2
    assert "confirm it with --yes" in capsys.readouterr().err
    assert run_command_line(settings, ["import", str(good), "--unit", "E-1", "--yes", "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["unit"] == "E-1"
    assert run_command_line(settings, ["import", str(bad), "--unit", "E-1", "--yes"]) == 2
    assert "not known: save the description" in " ".join(capsys.readouterr().err.split())
    assert run_command_line(settings, ["import", str(good), "--yes"]) == 2
    assert "give the serial of the unit (--unit)" in capsys.readouterr().err
