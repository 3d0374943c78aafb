"""The same jobs without any disaster: what a disturbed run must give, byte for byte."""

import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import httpx

from tests.chaos.books import Books, twin_key
from tests.chaos.databases import engine
from tests.chaos.director import START_S
from tests.chaos.load import RECIPES
from tests.chaos.processes import Ledger, Topology


def twins(folder: Path) -> dict[str, dict[int, str]]:
    """Run every recipe with every seed on an SQLite database in a folder; the content hash of each station."""
    url = f"sqlite:///{folder / 'undisturbed.sqlite'}"
    topology = Topology(Ledger(), folder, url, {})
    asked: dict[str, str] = {}
    try:
        topology.start()
        with httpx.Client(base_url=f"http://127.0.0.1:{topology.ports[0]}", timeout=60, trust_env=False) as http:
            _wait(lambda: _says(http, "/healthz"))
            for procedure, parameters, seeds, _ in RECIPES:
                for seed in seeds:
                    body = {"procedure": procedure, "unit": "SIM-0001", "parameters": parameters, "seed": seed}
                    labels = {"chaos": str(len(asked))}
                    answer = http.post("/api/v1/jobs", json={**body, "labels": labels})
                    assert answer.status_code == 202, answer.text
                    job = asked[twin_key(procedure, parameters, seed)] = answer.json()["id"]
                    _wait(lambda path=f"/api/v1/jobs/{job}": _ended_well(http.get(path).json()))
        topology.end_in_order()
    finally:
        topology.end_at_once()
    found: dict[str, dict[int, str]] = {key: {} for key in asked}
    keys = {job: key for key, job in asked.items()}
    for row in Books(engine(url)).recordings:
        found[keys[row["job_id"]]][row["station_index"]] = row["content_hash"]
    return found


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
