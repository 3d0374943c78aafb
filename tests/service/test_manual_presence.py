"""A lease whose service is gone: without a sign of life of a process that answers clients the worker ends it."""

from pathlib import Path

import pytest

from bench_service.cli.asking.client import connect
from bench_service.drivers.device_register import DeviceRegister
from bench_service.jobs.manual import presence, reader
from bench_service.settings import Settings
from bench_service.wall_clock import monotonic_s, pause

MANUAL = "/api/v1/benches/sim/manual"
SILENT_S = 1.0


def _ended(http, seconds: float) -> dict | None:
    """A lease with a table that turns, once it has ended; None where it lives for so long."""
    lease = http.post(MANUAL, json={"reason": "a look", "by": "ann", "minutes": 5}).json()
    path = f"{MANUAL}/{lease['id']}"
    body = {"kind": "rate", "axis": "outer", "rate_deg_s": 20.0, "duration_s": 600.0, "by": "ann"}
    assert http.post(f"{path}/demands", json=body).status_code == 202
    deadline = monotonic_s() + seconds
    while monotonic_s() < deadline:
        if (found := http.get(path).json())["ended_at"] is not None:
            return found
        pause(0.05)
    http.post(f"{path}/end", json={})
    return None


@pytest.mark.parametrize("answers", [False, True])
def test_a_lease_lives_while_somebody_answers_clients(
    answers: bool, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(reader, "LEASE_SILENT_S", SILENT_S)
    beat = presence.Presence.__init__
    monkeypatch.setattr(presence.Presence, "__init__", lambda self, store: beat(self, store, 0.2))
    if not answers:
        monkeypatch.setattr(presence.Presence, "_run", lambda self: None)
    settings = Settings(
        database_url=f"sqlite:///{tmp_path / 'bench.sqlite'}", device_folder=tmp_path, real_time_factor=20.0
    )
    with connect(settings, None, drive=True) as http:
        lease = _ended(http, 3.0 * SILENT_S if answers else 30.0)
    if answers:
        assert lease is None
        return
    assert lease is not None
    assert (lease["safe"], lease["ended_because"]) == (
        True,
        "no process that serves clients has given a heartbeat for 1 s",
    )
    state = DeviceRegister(tmp_path, "sim").read()
    assert state is not None
    assert state.safe
