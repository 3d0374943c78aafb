"""The supervisor beside a driving process is started again when it ends, at a pace, and not in another one's place."""

import logging
import os
import signal
import subprocess
from collections.abc import Iterator
from dataclasses import dataclass, field
from itertools import pairwise
from pathlib import Path

import pytest

from bench_service.bench.heartbeat import SUPERVISOR_KILLED_S, Heartbeat, HeartbeatFile, SilenceCounter
from bench_service.bench.processes import ProcessIdentity
from bench_service.cli.processes.companion import AGAIN_S, SLOWEST_S, UNSUPERVISED_S, Companion
from bench_service.cli.processes.supervising import SUPERVISED_ALREADY
from bench_service.persistence.bench.host_files import HostFiles
from bench_service.wall_clock import pause
from tests.kit.supervised_bench import GONE, identity

KILLED = -9


@dataclass
class Child:
    """A process that ends when it is told to."""

    code: int | None = None

    def poll(self) -> int | None:
        return self.code


@dataclass
class Host:
    """Starts children, and knows whether somebody else supervises."""

    started: list[Child] = field(default_factory=list)
    another: bool = False
    refuses: bool = False

    def spawn(self) -> Child:
        if self.refuses:
            raise OSError("no process can be had")
        self.started.append(Child())
        return self.started[-1]

    def supervisor(self) -> ProcessIdentity | None:
        return GONE.process if self.another or (self.started and self.started[-1].code is None) else None


@pytest.fixture
def host() -> Host:
    return Host()


@pytest.fixture
def companion(host: Host, tmp_path: Path) -> Companion:
    return Companion("sim", host.spawn, host.supervisor, SilenceCounter(HeartbeatFile(tmp_path, "sim")))


def test_one_that_was_killed_comes_back_at_once_but_not_twice_within_a_second_and_it_is_said(
    host: Host, companion: Companion, caplog: pytest.LogCaptureFixture
) -> None:
    companion.look(0.0)
    companion.look(5.0)
    assert len(host.started) == 1
    host.started[0].code = KILLED
    with caplog.at_level(logging.WARNING):
        companion.look(10.0)
    assert "bench sim was ended by signal 9: started again now" in caplog.text
    assert len(host.started) == 2
    host.started[1].code = KILLED
    companion.look(10.5)
    companion.look(10.0 + 1.9 * AGAIN_S)
    assert len(host.started) == 2
    companion.look(10.0 + 2 * AGAIN_S)
    assert len(host.started) == 3


def test_one_that_does_not_last_is_started_ever_more_slowly_and_one_that_lasted_soon_again(
    host: Host, companion: Companion
) -> None:
    """Ended as soon as it is seen: the times of the starts, looked for every half second of ten minutes."""
    at: list[float] = []
    for half_seconds in range(1200):
        companion.look(now_s := half_seconds / 2)
        if len(host.started) > len(at):
            at.append(now_s)
            host.started[-1].code = 1
    pauses = [later - earlier for earlier, later in pairwise(at)]
    assert min(pauses) >= AGAIN_S
    assert pauses == sorted(pauses)
    assert pauses[-1] == pytest.approx(SLOWEST_S, abs=1.0)
    host.started[-1].code = None
    companion.look(10_000.0)  # the next start, which lasts
    count = len(host.started)
    companion.look(10_000.0 + SLOWEST_S)
    host.started[-1].code = KILLED
    companion.look(10_100.0)
    assert len(host.started) == count + 1


def test_one_that_left_the_bench_to_another_comes_back_only_when_nobody_has_supervised_it_for_a_while(
    host: Host, companion: Companion
) -> None:
    host.another = True
    companion.look(0.0)  # the first start is not asked for twice: the other one may be about to leave
    host.started[0].code = SUPERVISED_ALREADY
    for second in range(1, 100):
        companion.look(float(second))
    assert len(host.started) == 1
    host.another = False
    companion.look(100.0)
    host.another = True  # whoever keeps it has started it again
    companion.look(99.0 + UNSUPERVISED_S)
    host.another = False
    companion.look(102.0 + UNSUPERVISED_S)
    assert len(host.started) == 1
    companion.look(99.0 + 2 * UNSUPERVISED_S)
    assert len(host.started) == 2


def test_a_host_that_can_start_no_process_is_asked_again(host: Host, companion: Companion) -> None:
    host.refuses = True
    companion.look(0.0)
    host.refuses = False
    companion.look(0.5 * AGAIN_S)
    assert not host.started
    companion.look(AGAIN_S)
    assert len(host.started) == 1


@pytest.fixture
def supervisor() -> Iterator[subprocess.Popen[bytes]]:
    """A process that stands for a supervisor that somebody else started."""
    process = subprocess.Popen(["sleep", "300"])
    yield process
    process.kill()
    process.wait()


@pytest.fixture
def beating(tmp_path: Path, supervisor: subprocess.Popen[bytes]) -> HeartbeatFile:
    """The supervisor's heartbeat, written here in its name."""
    file = HeartbeatFile(tmp_path, "sim", of_supervisor=True)
    file._own = identity(supervisor)
    file.prepare()
    file.beat()
    return file


def test_a_supervisor_that_lives_without_a_heartbeat_is_killed_and_another_one_is_started(
    tmp_path: Path,
    host: Host,
    supervisor: subprocess.Popen[bytes],
    beating: HeartbeatFile,
    caplog: pytest.LogCaptureFixture,
) -> None:
    """Killed, not only replaced: one that is continued later would act beside the new one."""
    os.kill(supervisor.pid, signal.SIGSTOP)
    silence = SilenceCounter(HeartbeatFile(tmp_path, "sim", of_supervisor=True))
    there = identity(supervisor)
    companion = Companion("sim", host.spawn, lambda: there if there.alive() else None, silence)
    companion.look(0.0)
    host.started[0].code = SUPERVISED_ALREADY
    looks = [quarter / 4 for quarter in range(1, int(4 * SUPERVISOR_KILLED_S) + 2)]
    for now_s in looks:
        beating.beat()
        companion.look(now_s)
    assert supervisor.poll() is None, "it gave its heartbeat"
    companion.look(later_s := looks[-1] + 1000.0)
    assert supervisor.poll() is None, "this process was suspended too: only half a second counts"
    for now_s in looks:
        companion.look(later_s + now_s)
    assert supervisor.wait(5) == -signal.SIGKILL
    assert "gave no heartbeat for 10 s: killed" in caplog.text
    for now_s in looks:
        companion.look(later_s + looks[-1] + now_s)
    assert len(host.started) == 2


@pytest.mark.parametrize(
    ("permitted", "said"),
    [(False, "belongs to another user: nobody watches over the bench"), (True, "killed, and another one is started")],
)
def test_a_supervisor_that_may_not_be_killed_or_ends_late_is_said_once(
    tmp_path: Path,
    host: Host,
    supervisor: subprocess.Popen[bytes],
    beating: HeartbeatFile,
    caplog: pytest.LogCaptureFixture,
    monkeypatch: pytest.MonkeyPatch,
    permitted: bool,
    said: str,
) -> None:
    def kill(_: ProcessIdentity) -> bool:
        if not permitted:
            raise PermissionError
        return True  # the signal is sent, and the process waits in the kernel

    monkeypatch.setattr(ProcessIdentity, "kill", kill)
    silence = SilenceCounter(HeartbeatFile(tmp_path, "sim", of_supervisor=True))
    companion = Companion("sim", host.spawn, lambda: identity(supervisor), silence)
    for quarter in range(100):
        companion.look(quarter / 4)
    assert caplog.text.count(said) == 1


def test_who_looks_sees_that_a_supervisor_lives_and_is_silent(
    tmp_path: Path, supervisor: subprocess.Popen[bytes], beating: HeartbeatFile, monkeypatch: pytest.MonkeyPatch
) -> None:
    files, there = HostFiles(tmp_path, "sim"), identity(supervisor)
    monkeypatch.setattr(files, "living_supervisor", lambda: there)
    assert (files.supervisor(), files.silent_supervisor()) == (there, None)
    real = beating.age_s(there)
    assert real is not None
    assert real < 5.0
    monkeypatch.setattr(HeartbeatFile, "age_s", lambda *_: real + 5.1)
    assert (files.supervisor(), files.silent_supervisor()) == (None, there)
    monkeypatch.setattr(HeartbeatFile, "age_s", lambda *_: None)  # one of an older version: it has none
    assert (files.supervisor(), files.silent_supervisor()) == (there, None)


def test_no_heartbeat_is_written_while_the_work_is_stuck(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("bench_service.bench.heartbeat.BEAT_S", 0.02)
    goes_on, file, own = [True], HeartbeatFile(tmp_path, "sim"), ProcessIdentity.own()
    beats = Heartbeat(file, lambda: goes_on[0])
    beats.begin()
    while file.last(own) < 3:
        pause(0.01)
    goes_on[0] = False
    pause(0.1)
    stuck = file.last(own)
    pause(0.1)
    assert file.last(own) == stuck
    beats.end()
