"""The supervisor's judgement, look by look: with a database that does not answer, devices that do not obey, clocks that
jump. Real files and real processes; `tests/end_to_end/test_supervisor.py` has it whole.
"""

import subprocess
from datetime import timedelta
from pathlib import Path

import pytest

from bench_service import wall_clock
from bench_service.bench.devices import DeviceState
from bench_service.bench.processes import Driving
from bench_service.bench.supervisor import Supervisor
from bench_service.drivers.registered import RegisteredDevices
from bench_service.model.errors import BenchBusy, StorageFailure
from bench_service.wall_clock import monotonic_s, pause
from procedures.bench.errors import DeviceFault
from tests.kit.abandoned_bench import abandoned
from tests.kit.busy_machine import BUSY_S
from tests.kit.supervised_bench import GONE, Books, Lease, Watch, identity, look_for, state, supervised


def test_the_lease_is_taken_the_bench_made_safe_the_lease_given_back_and_all_of_it_noted(tmp_path: Path) -> None:
    devices, books, lease = RegisteredDevices(abandoned(tmp_path, "job-1")), Books(), Lease()
    supervisor = supervised(tmp_path, devices, Watch(GONE), books, lease.take)
    assert supervisor.look(companion=True)
    assert state(tmp_path).safe
    assert (lease.taken, lease.given_back) == (1, 1)
    assert supervisor.look(companion=True)
    assert len(books.said) == 1
    assert books.said[0].startswith("job-1: process 1 on nowhere is gone, and the table moves and the unit is on: made")


@pytest.mark.parametrize("lease", ["never answers", "is held by a dead connection", "fails"])
def test_a_database_that_does_not_answer_keeps_no_bench_from_being_safe(tmp_path: Path, lease: str) -> None:
    """The devices' own link is exclusive on the host: after a moment it must do. What was done is noted later."""
    devices, books = RegisteredDevices(abandoned(tmp_path, "job-1")), Books()
    books.answers = False

    def take() -> Lease:
        if lease == "never answers":
            pause(30)
        if lease == "fails":
            raise StorageFailure("no route")
        raise BenchBusy("bench 'sim' is driven by 'bench sim process pid 1 on nowhere'")

    supervisor = supervised(tmp_path, devices, Watch(GONE), books, take)
    begun = monotonic_s()
    supervisor.look()
    assert state(tmp_path).safe
    assert monotonic_s() - begun < BUSY_S
    supervisor.look()
    assert books.said == []
    books.answers = True
    supervisor.look()
    assert len(books.said) == 1


def test_a_worker_that_lives_is_left_alone(tmp_path: Path, worker: subprocess.Popen[bytes]) -> None:
    devices, lease = RegisteredDevices(abandoned(tmp_path)), Lease()
    watch = Watch(Driving(identity(worker)))
    supervisor = supervised(tmp_path, devices, watch, Books(), lease.take)
    assert supervisor.look(companion=True)
    assert not state(tmp_path).safe
    assert lease.taken == 0
    worker.kill()  # and nobody waits for it: a zombie is dead
    while watch.now is not None and watch.now.alive:
        pause(0.01)
    assert supervisor.look(companion=True)
    assert state(tmp_path).safe


def test_only_a_stop_that_is_not_answered_kills_and_only_the_process_that_is_meant(
    tmp_path: Path, worker: subprocess.Popen[bytes]
) -> None:
    devices, books = RegisteredDevices(abandoned(tmp_path)), Books()
    meant = Driving(identity(worker))
    supervisor = supervised(tmp_path, devices, Watch(meant), books, Lease().take, hung_s=0.3)
    for _ in range(5):
        supervisor.look()
        pause(0.1)
    assert worker.poll() is None, "killed without a stop"
    books.is_stopped = True
    pause(0.5)
    supervisor.look()
    assert worker.poll() is None, "killed before it could answer"
    deadline = monotonic_s() + 10
    while worker.poll() is None and monotonic_s() < deadline:
        pause(0.1)
        supervisor.look()
    assert worker.poll() == -9
    while meant.alive:
        pause(0.01)
    supervisor.look()
    assert state(tmp_path).safe
    supervisor.look()
    assert (
        "has seen a stop and has not made the bench safe within 0.3 s (the table moves, the unit is on): killed"
        in books.said[0]
    )
    pause(0.5)
    supervisor.look()
    assert "the supervisor" in books.confirmed


def test_devices_that_do_not_obey_stop_the_bench_once_and_are_tried_again(tmp_path: Path) -> None:
    register, books = abandoned(tmp_path), Books()

    class Jammed(RegisteredDevices):
        tries = 0

        def make_safe(self, by: str) -> DeviceState:
            Jammed.tries += 1
            if Jammed.tries < 3:
                raise ExceptionGroup("not safe", [DeviceFault("the brake does not close")])
            return super().make_safe(by)

    supervisor = supervised(tmp_path, Jammed(register), Watch(GONE), books, Lease().take)
    deadline = monotonic_s() + 20
    while not state(tmp_path).safe and monotonic_s() < deadline:
        assert supervisor.look(companion=True), "left a bench that is not safe"
        pause(0.05)
    assert Jammed.tries == 3
    supervisor.look()
    assert [line for line in books.said if "stopped" in line] == [
        "stopped: could not be made safe: the brake does not close"
    ]
    assert books.is_stopped, "a person must look, though it obeyed in the end"


def until_safe(supervisor: Supervisor, folder: Path) -> None:
    deadline = monotonic_s() + 20
    while not state(folder).safe and monotonic_s() < deadline:
        assert supervisor.look(companion=True), "left a bench that is not safe"
        pause(0.05)
    assert state(folder).safe


def test_a_device_whose_link_is_lost_keeps_the_bench_stopped_and_is_made_safe_once_it_is_back(tmp_path: Path) -> None:
    register, books = abandoned(tmp_path, "job-1"), Books()
    register.cables.cut("supply", "")
    supervisor = supervised(tmp_path, RegisteredDevices(register), Watch(GONE), books, Lease().take)
    for _ in range(3):
        assert supervisor.look(companion=True)
        pause(1.1)
    left = state(tmp_path)
    assert (left.table, left.powered, left.safe) == ("at rest", True, False)
    assert [line for line in books.said if "stopped" in line] == [
        "stopped: could not be made safe: the supply cannot be reached: its link is lost"
    ]
    register.cables.file("supply").unlink()
    until_safe(supervisor, tmp_path)
    supervisor.look()
    assert "made safe by the supervisor at last, " in books.said[-1]
    assert len(books.said) == 3, books.said


def test_a_worker_that_could_not_reach_a_device_is_not_killed_and_its_stopped_bench_tried_again(
    tmp_path: Path, worker: subprocess.Popen[bytes]
) -> None:
    """A worker does so: it takes the link, fails, gives the link back, stops the bench, and lives."""
    register, books, lease = abandoned(tmp_path, "job-1"), Books(), Lease()
    devices = RegisteredDevices(register)
    register.cables.cut("turntable", "")
    with pytest.raises(ExceptionGroup):
        devices.make_safe("the worker")
    before = register.journal.entries()
    supervisor = supervised(tmp_path, devices, Watch(Driving(identity(worker))), books, lease.take, hung_s=0.3)
    for _ in range(15):
        supervisor.look()
        pause(0.1)
    assert register.journal.entries() == before, "a living worker's bench was commanded, and nobody had stopped it"
    books.is_stopped = True
    for _ in range(30):
        supervisor.look()
        pause(0.1)
    assert worker.poll() is None, "killed for a cable that is out"
    assert register.journal.entries()[len(before) :], "not tried again"
    assert not state(tmp_path).safe
    register.cables.file("turntable").unlink()
    until_safe(supervisor, tmp_path)
    assert worker.poll() is None
    assert lease.taken == 0, "the worker has it"
    supervisor.look()
    assert "job-1: the bench is stopped, and the table moves and " in books.said[-1]
    assert "made safe by the supervisor at last" in books.said[-1]


def test_a_companion_leaves_after_an_orderly_end_at_once_and_after_a_crash_when_it_has_lasted(tmp_path: Path) -> None:
    register = abandoned(tmp_path)
    devices = RegisteredDevices(register)
    devices.make_safe("a test")
    ended = Watch(Driving(GONE.process, ended=True))
    assert not supervised(tmp_path, devices, ended, Books(), Lease().take).look(companion=True)
    crashed = supervised(tmp_path, devices, Watch(GONE), Books(), Lease().take, linger_s=0.3)
    assert crashed.look(companion=True)
    pause(0.4)
    assert not crashed.look(companion=True)
    assert crashed.look(companion=False), "one that was started by itself stays"


def test_a_wall_clock_that_jumps_changes_no_judgement(
    tmp_path: Path, worker: subprocess.Popen[bytes], monkeypatch: pytest.MonkeyPatch
) -> None:
    devices, books = RegisteredDevices(abandoned(tmp_path)), Books()
    books.is_stopped = True
    supervisor = supervised(tmp_path, devices, Watch(Driving(identity(worker))), books, Lease().take, hung_s=60.0)
    real = wall_clock.now
    for days in (400, -400, 0):
        monkeypatch.setattr(wall_clock, "now", lambda days=days: real() + timedelta(days=days))
        supervisor.look()
        pause(0.1)
    assert worker.poll() is None, "a jump of the clock was taken for a minute without an answer"


def test_devices_that_a_living_worker_has_left_unsafe_are_made_safe_without_any_stop(
    tmp_path: Path, worker: subprocess.Popen[bytes], monkeypatch: pytest.MonkeyPatch
) -> None:
    """It could not reach them, nor the database to stop the bench: nobody else would try before that is back."""
    monkeypatch.setattr("bench_service.bench.supervisor.LEFT_S", 0.3)
    register, books = abandoned(tmp_path, "job-1"), Books()
    link = register.open("the worker", "job-1")
    supervisor = supervised(
        tmp_path, RegisteredDevices(register), Watch(Driving(identity(worker))), books, Lease().take
    )
    look_for(supervisor, 0.5)
    assert not state(tmp_path).safe, "the worker has their link"
    link.close()
    look_for(supervisor, 0.2)
    assert not state(tmp_path).safe, "the worker may make them safe over a new link"
    look_for(supervisor, 0.6)
    assert (state(tmp_path).safe, worker.poll()) == (True, None)
    assert "job-1: its worker has left it unsafe, and the table moves and the unit is on: made safe" in books.said[0]
    assert not books.is_stopped
