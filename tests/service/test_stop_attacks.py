"""Attacks on the stop, each a way in which it was once missed: another process, file, version or key, no descriptor."""

import os
import signal
import subprocess
from collections.abc import Callable
from errno import EMFILE
from pathlib import Path
from typing import Any

import pytest

from bench_service.bench.processes import Driving
from bench_service.bench.records_in_place import encoded, write_record
from bench_service.bench.stop.channel import WORKER, StopChannel
from bench_service.bench.stop.word import StopAnswer, StopWord
from bench_service.bench_files import BenchFiles
from bench_service.cli.processes import stopping
from bench_service.cli.processes.stopping import REFUSED, SAFE, stop_command
from bench_service.drivers.device_register import DeviceRegister
from bench_service.drivers.registered import RegisteredDevices
from bench_service.jobs import stop_keys
from bench_service.jobs.stop_keys import StopKeys
from bench_service.model.errors import BenchBusy
from bench_service.persistence.bench.host_files import HostFiles
from bench_service.settings import Settings
from tests.kit.supervised_bench import Books, Lease, Watch, identity, look_for, supervised


def test_no_process_drives_a_bench_from_the_folder_of_another_one_that_lives(
    tmp_path: Path, worker: subprocess.Popen[bytes], monkeypatch: pytest.MonkeyPatch
) -> None:
    """Two databases, one folder: the supervisor watched the one that came last, and did not see the other's end."""
    files, other = HostFiles(tmp_path, "sim"), identity(worker)
    with monkeypatch.context() as as_other:
        as_other.setattr("bench_service.persistence.bench.host_files.ProcessIdentity.own", lambda: other)
        files.begin_driving()
    with pytest.raises(BenchBusy, match=f"is driven from the folder {tmp_path} by .*{worker.pid}"):
        files.begin_driving()
    assert files.driving() == Driving(other)
    worker.kill()
    worker.wait()
    files.begin_driving()
    files.begin_driving()  # its own record is no other process
    assert files.driving() != Driving(other)


def test_a_suspended_worker_with_the_link_of_safe_devices_is_killed_when_it_leaves_a_stop_unanswered(
    tmp_path: Path, worker: subprocess.Popen[bytes]
) -> None:
    """It would command them once it continues, and the stop was never answered as safe."""
    register = DeviceRegister(tmp_path, "sim")
    register.open("the worker", "job-1").note("a test", {})  # and the link is never given back
    os.kill(worker.pid, signal.SIGSTOP)
    watch = Watch(Driving(identity(worker)))
    supervisor = supervised(
        tmp_path, RegisteredDevices(register), watch, Books(), Lease().take, unanswered_s=0.2, silent_s=0.2, hung_s=0.2
    )
    channel, word = StopChannel(tmp_path, "sim"), StopWord("smoke", "Olena", "command")
    look_for(supervisor, 0.4)
    assert worker.poll() is None, "safe devices need no heartbeat"
    assert channel.ask(word)
    channel.answer(WORKER, StopAnswer("the worker", frozenset({word.id})))
    look_for(supervisor, 0.4)
    assert worker.poll() is None, "it has answered"
    more = StopWord("more smoke", "Olena", "command")
    assert channel.ask(more)
    look_for(supervisor, 0.6)
    assert worker.poll() == -signal.SIGKILL
    assert channel.state(more.id) == "safe"


def own_of(folder: Path, *benches: str) -> None:
    for bench in benches:
        DeviceRegister(folder, bench).open("a test").close()
        StopChannel(folder, bench).prepare()


def test_a_stop_by_a_bench_file_that_cannot_be_read_stops_no_other_bench(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    """It stopped the default one, `sim`, and said that it was safe."""
    file = tmp_path / "east.toml"
    file.write_text("[bench\nid = east")
    monkeypatch.setattr(stopping, "ALONE_S", 0.05)
    environ = {"BENCH_FILE": str(file), "BENCH_DEVICE_FOLDER": str(tmp_path)}
    own_of(tmp_path, "sim", "east")
    assert stop_command((), environ) == REFUSED
    assert f"NOTHING IS STOPPED: the bench file {file}" in (err := capsys.readouterr().err)
    assert "name it with --bench" in err
    assert err.rstrip().endswith("are: east, sim")
    assert StopChannel(tmp_path, "sim").standing() == ()
    alone = tmp_path / "alone"
    alone.mkdir()
    own_of(alone, "east")
    assert stop_command(("--reason", "smoke"), {**environ, "BENCH_DEVICE_FOLDER": str(alone)}) == SAFE
    assert [word.reason for word in StopChannel(alone, "east").standing()] == ["smoke"]
    assert stop_command((), {**environ, "BENCH_DEVICE_FOLDER": str(tmp_path / "none")}) == REFUSED
    assert capsys.readouterr().err.rstrip().endswith("are: none")


@pytest.mark.parametrize("seconds", ["nan", "inf", "-inf", "-1", "1e9", "soon"])
def test_a_time_to_wait_that_is_none_is_refused_and_said_to_stop_nothing(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], seconds: str
) -> None:
    """No comparison holds for nan: the command waited for ever, and never said that the bench is not safe."""
    own_of(tmp_path, "sim")
    assert stop_command((f"--wait={seconds}",), {"BENCH_DEVICE_FOLDER": str(tmp_path)}) == REFUSED
    said = capsys.readouterr().err
    assert f"--wait: {seconds}: seconds from 0 to 86400 are expected; NOTHING IS STOPPED" in said
    assert StopChannel(tmp_path, "sim").standing() == ()


def no_descriptor(*_: object) -> Any:
    raise OSError(EMFILE, "no descriptor is left")


def test_a_register_that_cannot_be_read_counts_as_not_safe(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The guard ended its look there, and the job went on."""
    settings = Settings(database_url=f"sqlite:///{tmp_path / 'bench.sqlite'}")
    own_of(tmp_path, "sim")
    files = BenchFiles(settings)
    assert files._is_safe()
    monkeypatch.setattr(DeviceRegister, "read", no_descriptor)
    assert not files._is_safe()


@pytest.mark.parametrize(
    "change",
    [
        lambda document: document | {"at": "2026-11-30T12:00:00"},
        lambda document: {k: v for k, v in document.items() if k != "reason"},
        lambda document: document | {"by": None},
        lambda document: document | {"at": "noon"},
    ],
)
def test_a_record_that_is_no_stop_of_this_version_stops_the_bench(
    tmp_path: Path, change: Callable[[dict[str, Any]], dict[str, Any]]
) -> None:
    """Worker and supervisor failed at each look, and saw no stop any more."""
    channel, good = StopChannel(tmp_path, "sim"), StopWord("smoke", "Olena", "command")
    channel.prepare()
    record = encoded(change(StopWord("strange", "Bo", "command").document()))
    assert record is not None
    write_record(channel._open(), 2, record)
    assert channel.ask(good)
    assert {word.id for word in channel.standing()} == {"damaged", good.id}
    channel.replace_damaged()
    strange = next(word for word in channel.standing() if word.id != good.id)
    assert (strange.reason, strange.booked) == ("a record of the stop channel cannot be read", False)
    channel.clear([strange.id])
    assert channel.standing() == (good,)


def test_a_field_of_a_newer_version_is_left_out(tmp_path: Path) -> None:
    channel, word = StopChannel(tmp_path, "sim"), StopWord("smoke", "Olena", "command")
    channel.prepare()
    record = encoded(word.document() | {"colour": "red"})
    assert record is not None
    write_record(channel._open(), 2, record)
    assert channel.standing() == (word,)
    channel.mark_booked([word.id])
    assert [found.booked for found in channel.standing()] == [True]


def test_a_key_that_comes_again_long_afterwards_is_another_stop(monkeypatch: pytest.MonkeyPatch) -> None:
    keys, at_s = StopKeys(), [1000.0]
    monkeypatch.setattr(stop_keys, "monotonic_s", lambda: at_s[0])
    first = keys.of("sim", "the button", StopWord("pressed", "Bo", "http"))
    at_s[0] += stop_keys.KEPT_S - 1.0
    assert keys.of("sim", "the button", StopWord("pressed", "Bo", "http")) is first
    at_s[0] += 2.0
    second = keys.of("sim", "the button", StopWord("pressed", "Bo", "http"))
    assert second is not first
    assert keys.of("sim", "the button", StopWord("pressed", "Bo", "http")) is second
