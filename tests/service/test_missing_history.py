"""A bench whose devices remember jobs, on a database that has none: a person is told that the history is missing."""

from pathlib import Path

from bench_service.bench.devices import DeviceState
from bench_service.cli.asking.client import connect
from bench_service.jobs.history import missing_history
from bench_service.persistence import open_stores
from bench_service.settings import Settings
from tests.service.client import Client


def test_a_database_that_lost_its_history_is_told_at_the_start(tmp_path: Path) -> None:
    settings = Settings(database_url=f"sqlite:///{tmp_path / 'bench.sqlite'}", device_folder=tmp_path / "devices")
    with connect(settings, None, drive=True) as http:
        client = Client(http)
        assert http.get("/readyz").json()["notes"] == []
        assert client.wait(client.submit()["id"])["state"] == "succeeded"
        assert http.get("/readyz").json()["notes"] == []
    for path in tmp_path.glob("bench.sqlite*"):
        path.unlink()
    with connect(settings, None, drive=True) as http:
        client = Client(http)
        (note,) = http.get("/readyz").json()["notes"]
        assert "its devices were driven on this host before" in note
        assert "the history is missing" in note
        client.wait(client.submit("no_operation")["id"])
        assert http.get("/readyz").json()["notes"] == []  # from the first job on it is a new history, on purpose


def test_a_bench_that_was_started_and_never_worked_misses_nothing(sqlite_url: str) -> None:
    stores, database = open_stores(sqlite_url)
    assert missing_history(None, stores.jobs) == ""
    assert missing_history(DeviceState(openings=1), stores.jobs) == ""
    assert missing_history(DeviceState(openings=2), stores.jobs) != ""
    database.dispose()
