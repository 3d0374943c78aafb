"""The same jobs without any disaster: what a disturbed run must give, byte for byte."""

import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import httpx

from tests.chaos.books import Books, twin_key
from tests.chaos.databases import engine
from tests.chaos.director import START_S
from tests.chaos.load import CAMPAIGN, KNOWN, Asked, campaign_run, recipes_beside_campaign
from tests.chaos.processes import Ledger, Topology


def twins(folder: Path) -> dict[str, dict[int, str]]:
    """Run every job that there may be once, some in a campaign, on an SQLite database in a folder; stations' hashes."""
    url = f"sqlite:///{folder / 'undisturbed.sqlite'}"
    topology = Topology(Ledger(), folder, url, {})
    try:
        topology.start()
        with httpx.Client(base_url=f"http://127.0.0.1:{topology.ports[0]}", timeout=60, trust_env=False) as http:
            _wait(lambda: _says(http, "/healthz"))
            assert http.post("/api/v1/campaigns", json=CAMPAIGN).status_code == 201
            for coefficients in KNOWN:
                assert http.post("/api/v1/units/SIM-0001/calibrations", json=coefficients).status_code == 201
            _ended(http, campaign_run(topology.benches[0], 0))
            for number, (procedure, parameters, seed) in enumerate(recipes_beside_campaign()):
                body = {"procedure": procedure, "unit": "SIM-0001", "parameters": parameters, "seed": seed}
                _ended(http, Asked("", {**body, "labels": {"chaos": str(number)}}, "none"))
        topology.end_in_order()
    finally:
        topology.end_at_once()
    books = Books(engine(url))
    keys = {
        job: twin_key(row["procedure"], row["requested_parameters"], row["seed"]) for job, row in books.jobs.items()
    }
    found: dict[str, dict[int, str]] = {key: {} for key in keys.values()}
    for row in books.recordings:
        found[keys[row["job_id"]]][row["station_index"]] = row["content_hash"]
    return found


def _ended(http: httpx.Client, asked: Asked) -> None:
    """Ask for a job or a campaign run, and wait for its end."""
    answer = http.post(asked.asked_at, json=asked.body)
    assert answer.status_code == 202, answer.text
    path = f"{asked.seen_at}/{answer.json()['id']}"
    _wait(lambda: _ended_well(http.get(path).json()))


def _says(http: httpx.Client, path: str) -> bool:
    try:
        return http.get(path).is_success
    except httpx.TransportError:
        return False


def _ended_well(job: dict[str, Any]) -> bool:
    assert job["state"] in ("queued", "running", "succeeded"), job
    return job["state"] == "succeeded"


def _wait(reached: Callable[[], bool]) -> None:
    end = time.monotonic() + START_S
    while not reached():
        assert time.monotonic() < end, "the undisturbed run does not come to its end"
        time.sleep(0.05)
