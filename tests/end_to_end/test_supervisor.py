"""The worker is killed, or hangs, in the middle of a move: the bench is made safe by a process that outlives it."""

import os
import signal
from collections.abc import Iterator
from pathlib import Path

import pytest

from bench_service.bench.supervisor import HUNG_S
from bench_service.wall_clock import monotonic_s, pause
from tests.chaos.journals import NOTICE_LIMIT_S, NOTICED
from tests.end_to_end.bench_process import BenchProcess, one_master_at_a_time

pytestmark = pytest.mark.timeout(240)


@pytest.fixture(params=["sqlite", "postgres"])
def bench(request: pytest.FixtureRequest, tmp_path: Path, free_port: int) -> Iterator[BenchProcess]:
    """A service at four times real time: a move lasts long enough to be hit."""
    url = f"sqlite:///{tmp_path / 'bench.sqlite'}"
    if request.param == "postgres":
        url = request.getfixturevalue("new_postgres_database")()
    made = BenchProcess(url, free_port, tmp_path, real_time_factor="4")
    made.start()
    yield made
    made.end()


def test_killed_in_a_move_the_bench_is_safe_within_two_seconds_of_being_noticed(
    bench: BenchProcess, capsys: pytest.CaptureFixture[str]
) -> None:
    bench.supervised()
    supervisor = bench.files.supervisor()
    job = bench.submit(seed=7)
    bench.until(lambda: bench.moving(job), 60)
    killed_s = monotonic_s()
    bench.kill()
    bench.until(lambda: bench.state().safe, 10)
    safe_s = monotonic_s() - killed_s
    assert "the supervisor" in bench.state().by
    bench.start()  # the supervisor may have the lease this moment: the service waits for it
    assert bench.files.supervisor() == supervisor, "one supervisor looks after the new process too"
    said = bench.events(job)
    found = NOTICED.search(said)
    assert found is not None, said
    noticed_s = float(found[1])
    with capsys.disabled():
        print(f"\nfrom kill to safe {safe_s:.3f} s, from notice to safe {noticed_s:.3f} s")
    assert noticed_s < NOTICE_LIMIT_S
    bench.until(lambda: bench.moving(job), 60)  # it goes on, under the new process
    answer = bench.client.post("/api/v1/benches/sim/stop", json={"reason": "a test"})
    assert answer.status_code == 202, answer.text
    bench.until(lambda: bench.job(job)["state"] == "cancelled", 60)
    assert bench.client.get("/api/v1/benches/sim").json()["safety"]["safe"] is True
    assert one_master_at_a_time(bench.register.journal.entries()) >= 3
    bench.process.terminate()
    assert bench.process.wait(60) == 0, bench.log.read_text()
    bench.until(lambda: bench.files.supervisor() is None, 20)


def test_a_worker_that_hangs_is_told_to_stop_and_then_killed(bench: BenchProcess) -> None:
    """SIGSTOP: the process is there and does nothing. The stop is noted by whoever else has the database."""
    bench.supervised()
    job = bench.submit(seed=7)
    bench.until(lambda: bench.moving(job), 60)
    bench.process.send_signal(signal.SIGSTOP)
    assert not bench.state().safe
    bench.stop_from_elsewhere()
    bench.until(lambda: bench.process.poll() is not None, 30)
    assert bench.process.returncode == -signal.SIGKILL
    bench.until(lambda: bench.state().safe, 10)
    bench.start()
    said = bench.events(job)
    assert "did not answer a stop" in said
    assert "made safe by the supervisor" in said
    bench.until(lambda: bench.job(job)["state"] == "cancelled", 60)
    view = bench.client.get("/api/v1/benches/sim").json()
    assert (view["state"], view["safety"]["safe"]) == ("stopped", True)


def test_with_worker_and_supervisor_killed_the_next_start_makes_the_bench_safe_first(bench: BenchProcess) -> None:
    bench.supervised()
    job = bench.submit(seed=7)
    bench.until(lambda: bench.moving(job), 60)
    supervisor = bench.files.supervisor()
    assert supervisor is not None
    os.kill(supervisor.pid, signal.SIGKILL)
    bench.kill()
    assert not bench.state().safe
    assert bench.files.supervisor() is None
    before = len(bench.register.journal.entries())
    bench.start()
    first = [entry["verb"] for entry in bench.register.journal.entries()[before:]]
    devices = ("turntable", "chamber", "current_source", "supply")
    assert first[:5] == ["link.opened", *(f"{device}.make_safe" for device in devices)]
    assert "made safe first" in bench.events(job)


@pytest.mark.parametrize("bench", ["sqlite"], indirect=True)
def test_a_supervisor_that_is_killed_is_replaced_while_its_worker_lives(
    bench: BenchProcess, capsys: pytest.CaptureFixture[str]
) -> None:
    bench.supervised()
    first = bench.files.supervisor()
    assert first is not None
    killed_s = monotonic_s()
    os.kill(first.pid, signal.SIGKILL)
    said = lambda: bench.client.get("/api/v1/benches/sim").json()["safety"]["supervisor"]  # noqa: E731
    bench.until(lambda: said() not in (None, str(first)), 20)
    with capsys.disabled():
        print(f"\nfrom the supervisor's kill to the next one {monotonic_s() - killed_s:.3f} s")
    second = bench.files.supervisor()
    assert second is not None
    assert second.alive()
    assert "was ended by signal 9: started again" in bench.log.read_text()
    job = bench.submit(seed=7)
    bench.until(lambda: bench.moving(job), 60)
    bench.kill()
    bench.until(lambda: bench.state().safe, 10)
    assert str(second) in bench.state().by, "the second one does what the first was there for"


@pytest.mark.parametrize("bench", ["sqlite"], indirect=True)
def test_no_supervisor_is_started_beside_one_that_is_there_or_by_a_process_that_ends(bench: BenchProcess) -> None:
    bench.supervised()
    keeper = bench.files.supervisor()
    bench.kill()
    bench.start()  # its companion finds the first one's at work
    log = bench.register.journal.path.parent / "bench-sim.supervisor.log"
    bench.until(lambda: "has another supervisor" in bench.log.read_text(), 20)
    assert bench.files.supervisor() == keeper
    assert log.read_text().count("supervising bench") == 1
    bench.terminate()
    bench.until(lambda: bench.files.supervisor() is None, 20)
    assert log.read_text().count("supervising bench") == 1


@pytest.mark.parametrize("bench", ["sqlite"], indirect=True)
def test_killed_with_a_cable_out_the_rest_is_made_safe_and_the_bench_waits_for_the_cable(bench: BenchProcess) -> None:
    bench.supervised()
    job = bench.submit(seed=7)
    bench.until(lambda: bench.moving(job), 60)
    bench.register.cables.cut("supply", "")
    bench.kill()
    bench.until(lambda: bench.state().table == "at rest", 10)
    bench.until(lambda: "cannot be reached" in bench.state().fault, 10)
    assert bench.state().powered
    supervisor = bench.files.supervisor()
    bench.start()  # it cannot reach it either
    bench.until(lambda: bench.client.get("/api/v1/benches/sim").json()["state"] == "stopped", 20)
    refused = bench.client.post("/api/v1/benches/sim/release")
    assert refused.status_code == 409, refused.text
    lost = "could not be made safe: the supply cannot be reached: its link is lost"
    assert refused.json()["detail"] == f"bench 'sim' is not released: {lost}"
    pause(HUNG_S + 1.0)
    assert bench.process.poll() is None, "killed for a cable that is out"
    view = bench.client.get("/api/v1/benches/sim").json()
    assert (view["state"], view["safety"]["safe"]) == ("stopped", False)
    bench.register.cables.file("supply").unlink()
    bench.until(lambda: bench.state().safe, 10)
    assert "the supervisor" in bench.state().by
    assert bench.files.supervisor() == supervisor
    released = bench.client.post("/api/v1/benches/sim/release")
    assert released.status_code == 200, released.text
    bench.until(lambda: "made safe by the supervisor at last" in bench.events(job), 10)
