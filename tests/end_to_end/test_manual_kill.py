"""The process that runs a lease of manual mode is killed in a move, and in a rate: safe by read-back over wires.

The devices are served simulators of this process, whose world is the witness.
"""

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from bench_service.drivers.device_register import DeviceRegister
from bench_service.persistence.bench.host_files import HostFiles
from bench_service.wall_clock import monotonic_s
from tests.conformance.served import Served, served
from tests.end_to_end.bench_process import BenchProcess
from tests.kit.wired_bench import LANGUAGES, bench_file

pytestmark = pytest.mark.timeout(240)
FACTOR = 4.0
AT_REST_DEG_S = 0.01
MANUAL = "/api/v1/benches/east/manual"
MOTIONS: dict[str, dict[str, Any]] = {
    "go_to": {"middle_deg": 170.0},
    "rate": {"axis": "outer", "rate_deg_s": 40.0, "duration_s": 600.0},
}
BACKENDS = {"go_to": "sqlite", "rate": "postgres"}
"""Motions that can be killed; one of them is in `make test`, for a service starts twice."""


@pytest.fixture(params=["rate"])
def wired(request: pytest.FixtureRequest, tmp_path: Path, free_port: int) -> Iterator[tuple[BenchProcess, Served, str]]:
    kind = request.param
    url = f"sqlite:///{tmp_path / 'bench.sqlite'}"
    if BACKENDS[kind] == "postgres":
        url = request.getfixturevalue("new_postgres_database")()
    with served(LANGUAGES, factor=FACTOR) as behind:
        made = BenchProcess(url, free_port, tmp_path, file=str(bench_file(tmp_path, behind, FACTOR)))
        made.register, made.files = DeviceRegister(tmp_path, "east"), HostFiles(tmp_path, "east")
        made.start()
        yield made, behind, kind
        made.end()


def _world(behind: Served) -> tuple[float, bool]:
    """True state of the served world: the largest rate of an axis [deg/s], and whether the unit is on."""
    return behind.do(
        lambda served: (
            float(np.max(np.abs(served.bench.turntable.read_rates_deg_s()))),
            served.bench.supply.is_on(),
        )
    )


def test_killed_in_a_motion_of_manual_mode_it_is_safe_by_its_own_readings(
    wired: tuple[BenchProcess, Served, str], capsys: pytest.CaptureFixture[str]
) -> None:
    bench, behind, kind = wired
    bench.supervised()
    lease = bench.client.post(MANUAL, json={"reason": "a look", "by": "ann", "unit": "GL017"})
    assert lease.status_code == 201, lease.text
    path = f"{MANUAL}/{lease.json()['id']}"

    def ask(**body: Any) -> str:
        made = bench.client.post(f"{path}/demands", json={**body, "by": "ann"})
        assert made.status_code == 202, made.text
        return made.json()["key"]

    key = ask(kind="supply_on")
    bench.until(lambda: bench.client.get(f"{path}/demands/{key}").json()["state"] == "done", 30)
    ask(kind=kind, **MOTIONS[kind])
    bench.until(lambda: _world(behind)[0] > 30.0, 30)
    killed_s = monotonic_s()
    bench.kill()
    bench.until(lambda: bench.state().safe, 20)
    with capsys.disabled():
        print(f"\n{kind} on {BACKENDS[kind]}: from kill to safe by read-back {monotonic_s() - killed_s:.3f} s")
    rate, powered = _world(behind)
    assert (rate < AT_REST_DEG_S, powered) == (True, False)
    assert "the supervisor" in bench.state().by
    bench.start()
    bench.until(lambda: bench.client.get(path).json()["ended_at"] is not None, 30)
    over = bench.client.get(path).json()
    assert (over["safe"], "ended or lost its database" in over["ended_because"]) == (True, True)
    assert {d["state"] for d in bench.client.get(f"{path}/demands").json()["items"]} == {"done", "stopped"}
    again = bench.client.post(MANUAL, json={"reason": "again", "by": "ann", "unit": "GL017"})
    assert again.status_code == 201, again.text
    noticed = [
        float(e["detail"]["text"].split("made safe by the supervisor ")[1].split(" s after")[0])
        for e in bench.client.get("/api/v1/audit", params={"limit": 100}).json()["items"]
        if "made safe by the supervisor " in str(e["detail"].get("text"))
    ]
    assert noticed, "the supervisor says in the audit trail how long it took"
    assert max(noticed) < 2.0
