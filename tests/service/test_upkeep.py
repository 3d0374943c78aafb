"""The check of the database: damage is named, kept in a report, and shown by API, command and readiness."""

import json
import sqlite3
from collections.abc import Iterator
from datetime import UTC, datetime, timedelta
from pathlib import Path

import pytest

from bench_service.cli.asking.client import connect
from bench_service.cli.commands import run_command_line
from bench_service.evidence.upkeep import NightlyScrub, UpkeepService, next_time
from bench_service.persistence import open_stores
from bench_service.persistence.migration import newest_revision
from bench_service.persistence.upkeep.contents import DatabaseContents
from bench_service.settings import Settings
from bench_service.wall_clock import now
from tests.service.client import Client

GYRO = {"name": "gyro_x", "column": "x", "quantity": "angular_rate", "unit": "deg/s"}
DESCRIPTION = {"unit": "IMPORTED-1", "time_column": "t", "channels": [GYRO]}
FILE = ("t,x\n" + "\n".join(f"{i / 100:.2f},{i % 7}.5" for i in range(600)) + "\n").encode()


@pytest.fixture
def client(tmp_path: Path) -> Iterator[tuple[Client, Settings]]:
    """A service that drives no bench, and its settings."""
    settings = Settings(database_url=f"sqlite:///{tmp_path / 'bench.sqlite'}")
    with connect(settings, None, drive=False) as http:
        yield Client(http), settings


def test_a_check_finds_a_damaged_chunk_and_everybody_is_told(
    client: tuple[Client, Settings], capsys: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    http, settings = client
    recording = http.import_files(DESCRIPTION, FILE).json()["id"]
    assert http.http.get("/api/v1/database").json()["last_scrub"] is None
    assert run_command_line(settings, ["scrub"]) == 0
    assert "1 recordings" in capsys.readouterr().out
    with sqlite3.connect(tmp_path / "bench.sqlite") as books:
        books.execute("UPDATE chunks SET payload = substr(payload, 2)")
    assert run_command_line(settings, ["scrub", "--json"]) == 1
    document = json.loads(capsys.readouterr().out)
    assert document["faults"] == []
    assert document["damaged_chunks"] == 1
    (chunk,) = document["damaged"]
    assert (chunk["recording"], chunk["number"], chunk["start"], chunk["stop"]) == (recording, 0, 0, 600)

    view = http.http.get("/api/v1/database").json()
    assert view["last_scrub"]["good"] is False
    assert view["last_scrub"]["document"] == document
    assert view["stored_bytes"] == (tmp_path / "bench.sqlite").stat().st_size
    assert [each["good"] for each in http.http.get("/api/v1/database/reports").json()["items"]] == [False, True]
    (note,) = http.http.get("/readyz").json()["notes"]
    assert f"chunk 0 of recording {recording}" in note
    assert run_command_line(settings, ["database"]) == 0
    assert "last check" in capsys.readouterr().out


def test_a_damaged_page_is_found_and_no_job_is_taken(client: tuple[Client, Settings], tmp_path: Path) -> None:
    http, settings = client
    for _ in range(30):
        assert http.import_files(DESCRIPTION, FILE).status_code == 201
    file = tmp_path / "bench.sqlite"
    with sqlite3.connect(file) as books:
        books.execute("PRAGMA wal_checkpoint(TRUNCATE)")
        root = books.execute("SELECT rootpage FROM sqlite_master WHERE name = 'ix_recordings_unit_id'").fetchone()[0]
        size = books.execute("PRAGMA page_size").fetchone()[0]
    with file.open("r+b") as pages:  # a page of an index: rows are read still, the database is damaged
        pages.seek((root - 1) * size + size // 2)
        pages.write(b"\x7f" * (size // 2))
    assert run_command_line(settings, ["scrub"]) == 1
    ready = http.http.get("/readyz")
    assert ready.status_code == 503
    assert "the database is damaged" in ready.json()["detail"]


def test_a_check_of_the_night_is_made_by_one_process(database_url: str) -> None:
    stores, database = open_stores(database_url)
    upkeep = UpkeepService(stores, DatabaseContents(database), "a test")
    began = now()
    assert upkeep.scrub(unless_since=began - timedelta(hours=6)) is not None
    assert upkeep.scrub(unless_since=began - timedelta(hours=6)) is None
    assert upkeep.scrub() is not None
    assert [report.good for report in stores.upkeep.list().items] == [True, True]
    size = upkeep.size()
    assert size.stored_bytes + (size.log_bytes or 0) > 100_000  # twenty tables, each of a page at the least
    assert size.revision == newest_revision()
    database.dispose()


def test_the_night_comes_once_a_day_on_the_hosts_clock() -> None:
    at = next_time("03:30", datetime(2031, 5, 6, 12, 0, tzinfo=UTC))
    assert (at.hour, at.minute, at.second) == (3, 30, 0)
    assert timedelta(0) < at - datetime(2031, 5, 6, 12, 0, tzinfo=UTC) <= timedelta(days=1)
    again = next_time("03:30", at)
    assert again - at == timedelta(days=1)


def test_a_night_that_has_come_is_used(sqlite_url: str, monkeypatch: pytest.MonkeyPatch) -> None:
    from bench_service.evidence import upkeep as module

    stores, database = open_stores(sqlite_url)
    monkeypatch.setattr(module, "LOOK_S", 0.01)
    soon = datetime.now(UTC) - timedelta(minutes=1)
    monkeypatch.setattr(
        module, "next_time", lambda at, moment: soon if moment < soon + timedelta(minutes=2) else moment
    )
    nightly = NightlyScrub(UpkeepService(stores, DatabaseContents(database), "a test"), "03:30")
    nightly.begin()
    for _ in range(500):
        if stores.upkeep.list().items and stores.upkeep.list().items[0].good:
            break
        nightly._ending.wait(0.02)
    nightly.end()
    nightly._thread.join()
    assert [report.good for report in stores.upkeep.list().items] == [True]
    database.dispose()


def test_the_commands_of_copies(
    client: tuple[Client, Settings], capsys: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    http, settings = client
    http.import_files(DESCRIPTION, FILE)
    copy = tmp_path / "copies" / "copy.sqlite"
    copy.parent.mkdir()
    assert run_command_line(settings, ["backup", str(copy), "--json"]) == 0
    made = json.loads(capsys.readouterr().out)
    assert (made["rows"]["recordings"], made["faults"], made["bytes"]) == (1, [], copy.stat().st_size)
    assert run_command_line(settings, ["backup", str(copy)]) == 2
    assert "exists already" in capsys.readouterr().err
    there = Settings(database_url=f"sqlite:///{tmp_path / 'there.sqlite'}")
    assert run_command_line(there, ["scrub"]) == 2
    assert "there is no database" in capsys.readouterr().err
    assert run_command_line(there, ["restore", str(copy)]) == 0
    assert run_command_line(there, ["scrub"]) == 0
    assert run_command_line(there, ["restore", str(copy)]) == 2
    assert "--replace puts it aside" in capsys.readouterr().err.replace("\n", " ")
    assert http.http.get("/api/v1/database").json()["last_backup"]["good"] is True
