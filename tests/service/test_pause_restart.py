"""What outlives the service: a paused job, a wish to pause, a stopped bench."""

from pathlib import Path

from bench_service.cli.client import connect
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
