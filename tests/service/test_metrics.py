"""Metrics that a monitor scrapes: right for every process of a database, also after a restart, and true."""

from bench_service.cli.asking.client import connect
from bench_service.settings import Settings
from tests.kit.metrics import scraped
from tests.service.campaigns import add, ended, named, start, until
from tests.service.client import FAST, Client


def test_the_numbers_follow_what_happened_in_every_process_alike(client: Client, database_url: str) -> None:
    before = scraped(client.http)
    client.wait(client.submit(parameters=FAST, seed=8)["id"])
    cancelled = client.submit(parameters={"dwell_s": 7200.0})
    client.wait(cancelled["id"], "running")
    while client.http.get("/api/v1/benches/sim").json()["job"] is None:
        pass
    running = scraped(client.http)
    assert running[("bench_state", "sim", "busy")] == running[("bench_busy", "sim")] == 1
    client.http.post(f"/api/v1/jobs/{cancelled['id']}/cancel")
    client.wait(cancelled["id"])
    client.http.get("/api/v1/jobs/none")
    after = scraped(client.http)
    name = "calibration_12_orientations"
    stations = sum(j["progress"]["station"] for j in client.http.get("/api/v1/jobs").json()["items"])
    bytes_stored = sum(r["stored_bytes"] for r in client.http.get("/api/v1/recordings?limit=500").json()["items"])
    assert after[("bench_jobs_finished_total", name, "succeeded", "fail")] == 1  # a plan so short cannot pass
    assert after[("bench_jobs_finished_total", name, "cancelled", "")] == 1
    assert after[("bench_job_duration_seconds_count", name)] == after[("bench_job_wait_seconds_count",)] == 2
    assert after[("bench_job_duration_seconds_bucket", "+Inf", name)] == 2
    assert after[("bench_stations_done_total",)] == stations >= 12
    assert after[("bench_jobs", "succeeded")] == before[("bench_jobs", "succeeded")] + 1
    assert after[("bench_driver_seen_seconds", "sim")] < 15
    route = ("GET", "/api/v1/jobs/{job_id}")
    assert after[("bench_http_requests_total", *route, "404")] == 1
    assert after[("bench_http_latency_seconds_count", *route)] > 1
    with connect(Settings(database_url=database_url), None, drive=False) as other:
        theirs = scraped(other)
    assert theirs[("bench_recordings_bytes",)] == bytes_stored > 0
    shared = ("bench_jobs", "bench_jobs_finished_total", "bench_job_duration_seconds_sum", "bench_stations_done_total")
    for key in after:
        if key[0] in shared:
            assert theirs[key] == after[key], key


def test_campaign_runs_are_counted_by_what_became_of_them(client: Client) -> None:
    http = client.http
    add(client, named("metered", {}))
    ended(client, start(client, "metered")["id"])
    http.post("/api/v1/benches/sim/stop")
    waits = start(client, "metered")["id"]
    until(client, waits, lambda run: run["waiting"])
    seen = scraped(http)
    assert seen[("bench_campaign_runs_finished_total", "metered", "succeeded", "pass")] == 1
    assert seen[("bench_campaign_runs_open", "metered", "running")] == 1
    http.post(f"/api/v1/campaign-runs/{waits}/cancel")
    ended(client, waits)
    seen = scraped(http)
    assert seen[("bench_campaign_runs_finished_total", "metered", "cancelled", "")] == 1
    assert ("bench_campaign_runs_open", "metered", "running") not in seen
    http.post("/api/v1/benches/sim/release").raise_for_status()


def test_a_stop_and_the_disk_are_seen(client: Client, database_url: str) -> None:
    http = client.http
    http.post("/api/v1/benches/sim/stop")
    stopped = scraped(http)
    http.post("/api/v1/benches/sim/release")
    assert (stopped[("bench_state", "sim", "stopped")], stopped[("bench_state", "sim", "idle")]) == (1, 0)
    assert scraped(http)[("bench_state", "sim", "idle")] == 1
    if database_url.startswith("sqlite"):
        assert stopped[("bench_free_disk_bytes",)] > 0
    else:
        assert ("bench_free_disk_bytes",) not in stopped, "the disk of another machine is not known"
    assert stopped[("bench_listeners",)] == stopped[("bench_listeners_dropped_total",)] == 0
