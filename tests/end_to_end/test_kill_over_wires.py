"""The worker of a bench on wires is killed in the middle of a move: the supervisor makes the devices safe over wires.

The devices are served simulators of this process, whose world is the witness. Where the table was turned while no
process drove it, the next start stops the bench; released, the bench works on: stations that are done
are kept, and each further one is moved to afresh.
"""

from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from bench_service.drivers.device_register import DeviceRegister
from bench_service.persistence.bench.host_files import HostFiles
from bench_service.wall_clock import monotonic_s
from simulators.turntable.device import SimTurntable
from tests.chaos.journals import NOTICE_LIMIT_S, NOTICED
from tests.conformance.served import Served, served
from tests.end_to_end.bench_process import BenchProcess
from tests.kit.killed_on_wires import AT_REST_DEG_S
from tests.kit.wired_bench import LANGUAGES, bench_file

pytestmark = pytest.mark.timeout(240)
FACTOR = 4.0
PLAN = {"positions": [[0, 170, 0, 2], [0, -170, 0, 2]], "delay_from": "rest", "settle_s": 0.5}


@pytest.fixture
def wired(tmp_path: Path, free_port: int) -> Iterator[tuple[BenchProcess, Served]]:
    with served(LANGUAGES, factor=FACTOR) as behind:
        file = bench_file(tmp_path, behind, FACTOR)
        made = BenchProcess(f"sqlite:///{tmp_path / 'bench.sqlite'}", free_port, tmp_path, file=str(file))
        made.register, made.files = DeviceRegister(tmp_path, "east"), HostFiles(tmp_path, "east")
        made.start()
        yield made, behind
        made.end()


def _world(behind: Served) -> tuple[bool, bool, float]:
    """True state of the served world: whether the table moves, whether the unit is on, the middle encoder [deg]."""
    return behind.do(
        lambda served: (
            bool(np.any(np.abs(served.bench.turntable.read_rates_deg_s()) > AT_REST_DEG_S)),
            served.bench.supply.is_on(),
            served.bench.turntable.read_angles().middle_deg,
        )
    )


def test_killed_in_a_move_it_is_safe_by_its_own_readings_and_a_turned_table_is_noticed(
    wired: tuple[BenchProcess, Served], capsys: pytest.CaptureFixture[str]
) -> None:
    bench, behind = wired
    bench.supervised()
    job = bench.submit("table_program", unit="GL017", parameters=PLAN)
    bench.until(lambda: len(bench.recordings(job)) == 1 and bench.moving(job) and _world(behind)[0], 90)
    kept = bench.recordings(job)[0]["id"]
    killed_s = monotonic_s()
    bench.kill()
    bench.until(lambda: bench.state().safe, 20)
    moving, powered, _ = _world(behind)
    with capsys.disabled():
        print(f"\nfrom kill to safe by read-back {monotonic_s() - killed_s:.3f} s")
    assert (moving, powered) == (False, False)
    assert "the supervisor" in bench.state().by

    def turn_by_hand(served: object) -> None:
        table = behind.bench.bench.turntable
        here = table.read_angles()
        turned = replace(here, middle_deg=here.middle_deg + 5.0)
        SimTurntable.place(table, turned, np.zeros(3))  # the axes turn; a served person sets the unit alone

    link = bench.register.open("a test: where the table came to rest")
    link.note("a test", {}, angles_deg=(0.0, _world(behind)[2], 0.0))
    link.close()
    behind.do(turn_by_hand)
    bench.start()
    said = bench.events(job)
    found = NOTICED.search(said)
    assert found is not None, said
    noticed_s = float(found[1])
    assert noticed_s < NOTICE_LIMIT_S
    standing = bench.client.get("/api/v1/benches/east").json()
    assert standing["state"] == "stopped"
    assert "the middle axis of the turntable stands at" in str(standing)
    assert "and was left at" in str(standing)
    answer = bench.client.post("/api/v1/benches/east/release", json={"remark": "looked"})
    assert answer.is_success, answer.text
    bench.until(lambda: bench.job(job)["state"] in ("succeeded", "failed", "cancelled"), 90)
    assert kept in [r["id"] for r in bench.recordings(job)]
    if bench.job(job)["state"] == "cancelled":  # it was taken up again while the stop stood, which ends jobs
        job = bench.submit("table_program", unit="GL017", parameters=PLAN)
        bench.until(lambda: bench.job(job)["state"] in ("succeeded", "failed"), 90)
    assert bench.job(job)["state"] == "succeeded", bench.job(job)
    for recording in bench.recordings(job):
        mean, asked = recording["measured"]["angles"]["mean"], recording["station"]["angles"]
        assert mean["middle_deg"] == pytest.approx(asked["middle_deg"], abs=2e-4)
