"""States that outlive the service: a paused job, a wish to pause, a stopped bench."""

import json
import sqlite3
from contextlib import closing
from pathlib import Path

from bench_service.cli.asking.client import connect
from bench_service.settings import Settings
from bench_service.wall_clock import monotonic_s, pause
from tests.service.client import FAST, Client

SLOW = {**FAST, "dwell_s": 600.0}


def hashes(client: Client, job_id: str) -> list[str]:
    return [r["content_hash"] for r in client.recordings(job_id)]


def test_a_pause_survives_the_service_and_a_resume_gives_what_an_undisturbed_job_gives(tmp_path: Path) -> None:
    settings = Settings(database_url=f"sqlite:///{tmp_path / 'bench.sqlite'}")
    with connect(settings, None, drive=True) as http:
        first = Client(http)
        undisturbed = first.wait(first.submit(seed=5, parameters=SLOW)["id"])["id"]
        job = first.submit(seed=5, parameters=SLOW)["id"]
        deadline = monotonic_s() + 60.0
        while first.job(job)["progress"]["station"] < 4:
            assert monotonic_s() < deadline
            pause(0.005)
        http.post(f"/api/v1/jobs/{job}/pause")
        assert first.wait(job, "paused")["progress"]["station"] < 12
    with connect(settings, None, drive=True) as http:
        second = Client(http)
        assert second.job(job)["state"] == "paused"
        assert http.post(f"/api/v1/jobs/{job}/resume").status_code == 202
        assert second.wait(job)["state"] == "succeeded"
        assert hashes(second, job) == hashes(second, undisturbed)


def store_version(database: Path, job: str, version: int) -> int:
    """Have every checkpoint of a job be of a version; the one that they were of."""
    with closing(sqlite3.connect(database)) as connection, connection:
        rows = connection.execute("SELECT id, checkpoint FROM recordings WHERE job_id = ?", (job,)).fetchall()
        found = [(recording, json.loads(text)) for recording, text in rows if text is not None]
        for recording, checkpoint in found:
            changed = json.dumps({**checkpoint, "version": version})
            connection.execute("UPDATE recordings SET checkpoint = ? WHERE id = ?", (changed, recording))
    (before,) = {checkpoint["version"] for _, checkpoint in found if checkpoint is not None}
    return before


def test_a_job_whose_world_another_version_stored_ends_with_both_versions_and_what_to_do(tmp_path: Path) -> None:
    database = tmp_path / "bench.sqlite"
    with connect(Settings(database_url=f"sqlite:///{database}"), None, drive=True) as http:
        client = Client(http)
        undisturbed = client.wait(client.submit(seed=5, parameters=SLOW)["id"])["id"]
        job = client.submit(seed=5, parameters=SLOW, retries=2)["id"]
        deadline = monotonic_s() + 60.0
        while client.job(job)["progress"]["station"] < 4:
            assert monotonic_s() < deadline
            pause(0.005)
        http.post(f"/api/v1/jobs/{job}/pause")
        done = client.wait(job, "paused")["progress"]["station"]
        present = store_version(database, job, 1)
        http.post(f"/api/v1/jobs/{job}/resume").raise_for_status()
        failed = client.wait(job)
        assert (failed["state"], failed["verdict"], failed["attempt"]) == ("failed", "error", 2), "and is not retried"
        assert failed["error"]["kind"] == "OtherVersion"
        for words in ("version 1 of", f"these are version {present}", "Submit it again with the same seed"):
            assert words in failed["error"]["message"]
        assert len(client.recordings(job)) == done, "what was recorded is kept"
        view = http.get("/api/v1/benches/sim").json()
        assert (view["state"], view["safety"]["safe"]) == ("idle", True)
        assert client.wait(client.submit("no_operation")["id"])["state"] == "succeeded"

        store_version(database, job, present)  # the service that began it is back
        assert failed["resumable"]
        http.post(f"/api/v1/jobs/{job}/resume").raise_for_status()
        assert client.wait(job)["state"] == "succeeded"
        assert hashes(client, job) == hashes(client, undisturbed)


def test_a_stop_outlives_the_service(tmp_path: Path) -> None:
    settings = Settings(database_url=f"sqlite:///{tmp_path / 'bench.sqlite'}")
    with connect(settings, None, drive=True) as http:
        http.post("/api/v1/benches/sim/stop")
        job = Client(http).submit("no_operation")["id"]
    with connect(settings, None, drive=True) as http:
        after = Client(http)
        assert http.get("/api/v1/benches/sim").json()["state"] == "stopped"
        pause(0.5)
        assert after.job(job)["state"] == "queued"
        http.post("/api/v1/benches/sim/release")
        assert after.wait(job)["state"] == "succeeded"
