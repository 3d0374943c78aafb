"""Acts of the supervisor about a stop in the channel and about a heartbeat that is missing, look by look."""

import subprocess
from pathlib import Path

import pytest

from bench_service.bench.heartbeat import HeartbeatFile
from bench_service.bench.processes import Driving
from bench_service.bench.stop.channel import WORKER, StopChannel
from bench_service.bench.stop.word import StopAnswer, StopWord
from bench_service.bench.supervisor import Supervisor
from bench_service.drivers.device_register import DeviceRegister
from bench_service.drivers.registered import RegisteredDevices
from bench_service.wall_clock import monotonic_s, pause
from tests.kit.abandoned_bench import abandoned
from tests.kit.supervised_bench import GONE, Books, Lease, Watch, identity, state, supervised


def look_for(supervisor: Supervisor, seconds: float) -> None:
    end = monotonic_s() + seconds
    while monotonic_s() < end:
        supervisor.look()
        pause(0.05)


def test_a_word_in_the_channel_that_the_worker_leaves_unanswered_ends_it_without_any_database(
    tmp_path: Path, worker: subprocess.Popen[bytes]
) -> None:
    devices, books = RegisteredDevices(abandoned(tmp_path, "job-1")), Books()
    books.answers = False
    meant = Watch(Driving(identity(worker)))
    supervisor = supervised(tmp_path, devices, meant, books, Lease().take, unanswered_s=0.5)
    look_for(supervisor, 0.8)
    assert worker.poll() is None, "killed without a stop"
    channel, word = StopChannel(tmp_path, "sim"), StopWord("smoke", "Olena", "command")
    assert channel.ask(word)
    look_for(supervisor, 0.3)
    assert (worker.poll(), channel.state(word.id)) == (None, "seen")
    look_for(supervisor, 1.0)
    assert worker.poll() == -9
    assert (state(tmp_path).safe, channel.state(word.id)) == (True, "safe")
    assert not channel.standing()[0].booked
    books.answers = True
    look_for(supervisor, 0.7)
    assert [(stop.reason, stop.by) for stop in books.entered.values()] == [("smoke", "Olena")]
    assert channel.standing()[0].booked
    books.release(word.id)
    look_for(supervisor, 0.7)
    assert channel.standing() == ()


def test_a_worker_that_has_answered_a_stop_is_given_the_time_that_it_takes(
    tmp_path: Path, worker: subprocess.Popen[bytes]
) -> None:
    devices = RegisteredDevices(abandoned(tmp_path))
    watch = Watch(Driving(identity(worker)))
    supervisor = supervised(tmp_path, devices, watch, Books(), Lease().take, unanswered_s=0.3, hung_s=1.5)
    channel, word = StopChannel(tmp_path, "sim"), StopWord("smoke", "Olena", "command")
    channel.ask(word)
    channel.answer(WORKER, StopAnswer("the worker", frozenset({word.id})))
    look_for(supervisor, 1.0)
    assert worker.poll() is None
    look_for(supervisor, 1.2)
    assert worker.poll() == -9, "it has seen the stop, and the bench is not safe"


@pytest.mark.parametrize("beats", [True, False])
def test_a_worker_without_a_heartbeat_is_ended_while_its_bench_is_not_safe(
    tmp_path: Path, worker: subprocess.Popen[bytes], beats: bool
) -> None:
    register = abandoned(tmp_path, "job-1")
    watch = Watch(Driving(identity(worker)))
    heartbeat = HeartbeatFile(tmp_path, "sim")
    heartbeat.prepare()
    heartbeat._own = identity(worker)
    books = Books()
    supervisor = supervised(tmp_path, RegisteredDevices(register), watch, books, Lease().take, silent_s=0.6)
    for _ in range(12):
        if beats:
            heartbeat.beat()
        supervisor.look()
        pause(0.1)
    assert worker.poll() == (None if beats else -9)
    look_for(supervisor, 0.3)
    assert state(tmp_path).safe is not beats
    assert beats or "gave no heartbeat for 0.6 s (the table moves, the unit is on): killed" in books.said[0]


def test_a_stop_of_the_books_alone_is_said_in_the_channel_and_not_again_once_it_was_released(tmp_path: Path) -> None:
    books, channel = Books(), StopChannel(tmp_path, "sim")
    devices = RegisteredDevices(DeviceRegister(tmp_path, "sim"))
    supervisor = supervised(tmp_path, devices, Watch(GONE), books, Lease().take)
    books.is_stopped = True
    look_for(supervisor, 1.4)
    assert [(word.id, word.via, word.booked) for word in channel.standing()] == [(books.by_hand.id, "books", True)]
    books.is_stopped = False
    look_for(supervisor, 0.7)
    assert channel.standing() == ()
