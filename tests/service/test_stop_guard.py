"""The guard's answer to a stop, over a real channel: "safe" comes after the work was left, not before."""

import subprocess
from collections.abc import Generator
from pathlib import Path
from threading import Event

import pytest

from bench_service.bench.heartbeat import HeartbeatFile
from bench_service.bench.processes import Driving
from bench_service.bench.stop.channel import WORKER, StopChannel
from bench_service.bench.stop.guard import StopGuard
from bench_service.bench.stop.word import StopAnswer, StopWord
from bench_service.drivers.device_register import DeviceRegister
from bench_service.drivers.registered import RegisteredDevices
from bench_service.wall_clock import monotonic_s, pause
from tests.kit.busy_machine import BUSY_S
from tests.kit.supervised_bench import Books, Lease, Watch, identity, supervised


@pytest.fixture
def channel(tmp_path: Path) -> StopChannel:
    made = StopChannel(tmp_path, "sim")
    made.prepare()
    return made


class Work:
    """Work that takes until `over` to be left."""

    def __init__(self) -> None:
        self.over, self.asked = Event(), 0

    def leave(self) -> None:
        self.asked += 1
        assert self.over.wait(10)


@pytest.fixture
def work(channel: StopChannel, tmp_path: Path) -> Generator[Work]:
    work, heartbeat = Work(), HeartbeatFile(tmp_path, "sim")
    heartbeat.prepare()
    guard = StopGuard(channel, heartbeat, lambda: True, work.leave, lambda: None)
    guard.begin()
    yield work
    work.over.set()
    guard.end()


def until(channel: StopChannel, word: StopWord, state: str) -> None:
    deadline = monotonic_s() + BUSY_S
    while channel.state(word.id) != state and monotonic_s() < deadline:
        pause(0.02)
    assert channel.state(word.id) == state


def test_a_stop_that_finds_the_devices_safe_still_has_the_work_left_before_it_is_answered_safe(
    channel: StopChannel, work: Work
) -> None:
    """A job that is opening its devices has moved nothing yet, and would do so next."""
    word = StopWord("smoke", "Olena", "command")
    channel.ask(word)
    until(channel, word, "seen")
    pause(0.5)
    assert (channel.state(word.id), work.asked) == ("seen", 1)
    work.over.set()
    until(channel, word, "safe")
    pause(0.3)
    assert work.asked == 1, "once left it is not left again"
    second = StopWord("hands in the chamber", "Ivan", "command")
    channel.ask(second)
    until(channel, second, "safe")
    assert work.asked == 2


def test_the_supervisor_says_safe_for_a_worker_that_has_the_link_only_after_the_worker(
    channel: StopChannel, tmp_path: Path, worker: subprocess.Popen[bytes]
) -> None:
    register = DeviceRegister(tmp_path, "sim")
    link = register.open(by="the worker")
    watch = Watch(Driving(identity(worker)))
    supervisor = supervised(tmp_path, RegisteredDevices(register), watch, Books(), Lease().take)
    word = StopWord("smoke", "Olena", "command")
    channel.ask(word)
    supervisor.look()
    assert channel.state(word.id) == "seen"
    channel.answer(WORKER, StopAnswer("the worker", frozenset({word.id}), frozenset({word.id})))
    supervisor.look()
    assert channel.state(word.id) == "safe"
    link.close()
    second = StopWord("smoke again", "Olena", "command")
    channel.ask(second)
    supervisor.look()
    assert channel.state(second.id) == "safe", "nobody has the link: the register decides"
