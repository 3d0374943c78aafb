"""Tests that drive a bench of their own: a process has one job engine, so no other service may be open beside it."""

import sqlite3
from pathlib import Path

import pytest

from bench_service.cli.client import connect
from bench_service.settings import Settings
from tests.service.campaigns import add, named
from tests.service.client import Client


def test_where_the_entry_cannot_be_written_the_outcome_is_told_all_the_same(
    tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    file = tmp_path / "bench.sqlite"
    with connect(Settings(database_url=f"sqlite:///{file}"), None, drive=True) as http:
        other = sqlite3.connect(file)
        other.execute("CREATE TRIGGER full BEFORE INSERT ON audit BEGIN SELECT RAISE(ABORT, 'no room'); END")
        other.commit()
        other.close()
        assert http.post("/api/v1/benches/sim/stop").status_code == 202
        assert http.get("/api/v1/benches/sim").json()["state"] == "stopped"
        assert http.get("/api/v1/audit").json()["items"] == []
    assert "no room" in caplog.text
    assert "/api/v1/benches/sim/stop" in caplog.text


def test_where_benches_have_other_names_than_this_process_expects_a_campaign_is_examined_on_one_of_them(
    tmp_path: Path,
) -> None:
    """An HTTP process without a bench of its own; a run must still name its bench."""
    settings = Settings(database_url=f"sqlite:///{tmp_path / 'bench.sqlite'}")
    for bench in ("east", "west"):
        with connect(settings.model_copy(update={"bench_id": bench}), None, drive=True) as http:
            assert http.get(f"/api/v1/benches/{bench}").is_success
    with connect(settings, None, drive=False) as http:
        add(Client(http), named("somewhere", {}))
        refused = http.post("/api/v1/campaigns/somewhere/runs", json={"unit": "SIM-0001"})
        assert refused.status_code == 404, refused.text
        assert "there is no bench 'sim': there is east, west" in refused.json()["detail"]
        assert http.post("/api/v1/campaigns/somewhere/preview", json={"unit": "SIM-0001", "bench": "west"}).is_success
