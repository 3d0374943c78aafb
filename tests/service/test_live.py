"""Present state of a bench: sent while a job runs, to listeners and readers of this process and of another one."""

import json
from collections.abc import Generator, Iterator
from itertools import pairwise

import httpx
import numpy as np
import pytest

from bench_service.cli.asking.client import connect
from bench_service.settings import Settings
from bench_service.wall_clock import monotonic_s, pause
from tests.service.client import Client
from tests.service.page import page

LONG = {"dwell_s": 7200.0, "settle_s": 0.5}
"""Seconds of real time, many words."""
GRAVITY_M_S2 = 9.8
EARTH_RATE_RAD_S = 7.292115e-5


@pytest.fixture
def running(client: Client) -> Generator[dict]:
    job = client.submit(parameters=LONG, seed=3)
    client.wait(job["id"], "running")
    yield job
    client.http.post(f"/api/v1/jobs/{job['id']}/cancel")
    client.wait(job["id"])


def frames(lines: Iterator[str]) -> Iterator[dict[str, str]]:
    """Server-sent events as a browser takes them apart."""
    fields: dict[str, str] = {}
    for line in lines:
        if line == "" and fields:
            yield fields
            fields = {}
        elif line and not line.startswith(":"):
            name, _, value = line.partition(": ")
            fields[name] = value


def words(http: httpx.Client, job_id: str, count: int) -> list[dict]:
    """The first live words of a job."""
    found: list[dict] = []
    with http.stream("GET", f"/api/v1/jobs/{job_id}/events") as answer:
        for frame in frames(answer.iter_lines()):
            if frame.get("event") == "live":
                assert "id" not in frame
                found.append(json.loads(frame["data"]))
                if len(found) == count:
                    break
    return found


def inputs(client: Client, job_id: str, samples: dict, triad: str) -> np.ndarray:
    """Size of what a triad was exposed to in each stretch, from its live means and what it truly is: K⁻¹(U − b)."""
    truth = next(t for t in client.http.get(f"/api/v1/jobs/{job_id}/truth").json()["triads"] if t["triad"] == triad)
    means = {channel["name"]: channel["mean"] for channel in samples["channels"]}
    nominal = np.array([means[f"{triad}_{axis}"] for axis in "xyz"])
    return np.linalg.norm(np.linalg.solve(truth["matrix"], nominal - np.array(truth["bias"])[:, None]), axis=0)


def test_a_listener_hears_progress_devices_and_samples_in_nominal_units(client: Client, running: dict) -> None:
    told = words(client.http, running["id"], 4)
    times = [word["job"]["bench_time_s"] for word in told]
    assert times == sorted(times)
    assert times[-1] > times[0]
    for earlier, later in pairwise(told):
        assert later["job"]["fraction"] >= earlier["job"]["fraction"]
        assert later["job"]["eta_s"] <= earlier["job"]["eta_s"]
    # A word at the very beginning of a recording has no samples yet.
    last = next(word for word in reversed(told) if word["samples"] is not None)
    assert last["job"]["eta_s"] == pytest.approx(running["duration_s"] * (1 - last["job"]["fraction"]), abs=1e-6)
    assert last["job"]["eta_wall_s"] == pytest.approx(last["job"]["eta_s"] / last["job"]["bench_s_per_s"])
    assert last["devices"]["unit_on"]
    force, rate = (inputs(client, running["id"], last["samples"], triad) for triad in ("accelerometer", "gyro"))
    assert np.allclose(force, GRAVITY_M_S2, rtol=0.005)
    assert np.allclose(rate, EARTH_RATE_RAD_S, rtol=0.2)  # the noise of a stretch of ten seconds
    for channel in last["samples"]["channels"]:
        assert len(channel["mean"]) == len(last["samples"]["start_s"]) <= 10
        assert np.all(np.array(channel["minimum"]) <= channel["mean"])
        assert np.all(np.array(channel["maximum"]) >= channel["mean"])
        assert channel["unit"] == ("rad/s" if channel["name"].startswith("gyro") else "m/s^2")


def test_one_call_tells_how_far_a_job_is_in_both_times(client: Client, running: dict) -> None:
    words(client.http, running["id"], 2)
    progress = client.job(running["id"])["progress"]
    assert 0 < progress["eta_s"] < running["duration_s"]
    assert 0 < progress["eta_wall_s"] < progress["eta_s"]
    assert progress["label"].startswith("β=")
    bench = client.http.get("/api/v1/benches/sim").json()
    assert bench["driver_there"]
    assert bench["live"]["job"]["id"] == running["id"]
    shown = page(client, running["page"])
    assert "of bench time left" in shown.words
    assert "of 12 stations" in " ".join(shown.words.split())


def test_a_process_that_only_reads_hears_the_same(client: Client, running: dict, database_url: str) -> None:
    with connect(Settings(database_url=database_url), None, drive=False) as other:
        told = words(other, running["id"], 3)
        assert told[-1]["job"]["bench_time_s"] > told[0]["job"]["bench_time_s"]
        assert other.get(f"/api/v1/jobs/{running['id']}").json()["progress"]["eta_wall_s"] > 0
        bench = other.get("/api/v1/benches/sim").json()
        assert (bench["driver_there"], bench["live"]["job"]["id"]) == (True, running["id"])


def test_a_finished_job_has_no_live_word_and_the_driver_is_still_there(client: Client) -> None:
    job = client.wait(client.submit("no_operation")["id"])
    assert (job["progress"]["eta_wall_s"], job["progress"]["label"]) == (None, None)
    deadline = monotonic_s() + 10
    while client.http.get("/api/v1/benches/sim").json()["live"]["job"] is not None:
        assert monotonic_s() < deadline
        pause(0.05)
    bench = client.http.get("/api/v1/benches/sim").json()
    assert bench["driver_there"]
    assert bench["live"]["devices"] is None
