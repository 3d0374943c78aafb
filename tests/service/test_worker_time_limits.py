"""How long a supervisor waits for a worker that makes the bench safe: by the declared times of the bench's devices."""

from contextlib import ExitStack
from pathlib import Path
from unittest.mock import MagicMock

import pytest

from bench_service import driving
from bench_service.bench.heartbeat import HeartbeatFile
from bench_service.bench.processes import ProcessIdentity
from bench_service.bench.stop.channel import WORKER, StopChannel
from bench_service.bench.stop.word import StopAnswer, StopWord
from bench_service.bench.worker_time_limits import ENDING_S, HUNG_S, UNANSWERED_S, WorkerTimeLimits, hung_after_s
from bench_service.cli.processes import supervising
from bench_service.drivers.composition import longest_safe_s
from bench_service.drivers.device_register import DeviceRegister
from bench_service.drivers.interface import registry
from bench_service.jobs import engine
from bench_service.settings import Settings
from tests.kit import line_devices
from tests.kit.line_devices import bench_text

STEP_S = 0.5


def killed_after_s(folder: Path, hung_s: float, beats: bool) -> float | None:
    """Time after which a worker that has seen a stop is killed, by a clock of the test; None: not within 100 s."""
    channel, heartbeat, worker = StopChannel(folder, "sim"), HeartbeatFile(folder, "sim"), ProcessIdentity.own()
    channel.prepare()
    heartbeat.prepare()
    limits = WorkerTimeLimits(channel, heartbeat, UNANSWERED_S, hung_s, silent_s=10.0)
    word = StopWord("smoke", "Olena", "http")
    assert channel.ask(word)
    channel.answer(WORKER, StopAnswer("the worker", frozenset({word.id})))
    limits.reset(0.0)
    for look in range(200):
        if beats:
            heartbeat.beat()
        if limits.over(look * STEP_S, worker, frozenset({word.id}), stopped=True) is not None:
            return look * STEP_S
    return None


def settings_of(folder: Path, table_safe_s: str) -> Settings:
    """Settings with a bench file whose other devices are declared to be safe within 2 s."""
    text = bench_text(line_devices.table(), line_devices.supply(), line_devices.chamber()).replace(':0"', ':2049"')
    assert text.count("safe_s = 2.0") == 3
    path = folder / "east.toml"
    path.write_text(text.replace("safe_s = 2.0", table_safe_s, 1))
    return Settings(database_url=f"sqlite:///{folder / 'bench.sqlite'}", bench_file=path)


@pytest.mark.parametrize(
    ("declared", "safe_s", "hung_s"),
    [("safe_s = 60.0", 60.0, 65.0), ("", 60.0, 65.0), ("safe_s = 2.0", 2.0, HUNG_S), ("safe_s = 8.0", 8.0, 13.0)],
)
def test_the_time_follows_the_slowest_device_of_the_bench_file(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, declared: str, safe_s: float, hung_s: float
) -> None:
    """A table without a declaration has the 60 s of every real table."""
    monkeypatch.setattr(registry, "SHIPPED", line_devices.SHIPPED)
    assert longest_safe_s(settings_of(tmp_path, declared)) == safe_s
    assert hung_after_s(safe_s) == hung_s


def test_the_supervisor_is_given_that_time(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    given: dict[str, float] = {}

    class Watching:
        def __init__(self, *_: object, hung_s: float = HUNG_S) -> None:
            given["hung_s"] = hung_s

        def run(self, *_: object) -> None: ...

        def goes_on(self) -> bool:
            return True

    for name in ("set_up", "protect", "ending_on_signals"):
        monkeypatch.setattr(supervising, name, lambda *_: None)
    monkeypatch.setattr(supervising, "Supervisor", Watching)
    monkeypatch.setattr(registry, "SHIPPED", line_devices.SHIPPED)
    settings = settings_of(tmp_path, "safe_s = 60.0").model_copy(update={"stop_listen": ""})
    assert supervising.supervise(settings, False, lambda _: None) == 0
    assert given == {"hung_s": 65.0}


@pytest.mark.parametrize(("declared", "ending_s"), [("safe_s = 60.0", 70.0), ("safe_s = 2.0", ENDING_S)])
def test_a_service_that_ends_waits_for_the_slowest_device_of_the_bench_file(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, declared: str, ending_s: float
) -> None:
    """Nobody else makes a bench safe that `bench run` drives: it has no supervisor."""
    given: list[object] = []
    monkeypatch.setattr(registry, "SHIPPED", line_devices.SHIPPED)
    for name in ("acquire_lease", "LiveBoard", "Heartbeat", "spread_processes", "begin_notifier"):
        monkeypatch.setattr(driving, name, MagicMock())
    monkeypatch.setattr(driving, "ManualRunner", lambda *arguments: given.append(arguments[-1]))
    monkeypatch.setattr(engine, "Engine", lambda *arguments: given.append(arguments[-1]))
    settings = settings_of(tmp_path, declared)
    with ExitStack() as closing:
        worker, _ = driving.driving(settings, *(MagicMock() for _ in range(7)), closing)
    worker._make_engine(worker._runner)
    assert given == [ending_s, ending_s]


def test_a_simulated_bench_and_a_bench_file_that_is_gone(tmp_path: Path) -> None:
    settings = Settings(database_url=f"sqlite:///{tmp_path / 'bench.sqlite'}")
    assert hung_after_s(longest_safe_s(settings)) == HUNG_S
    register = DeviceRegister(settings.devices_in(), "sim")
    link = register.open("a test")
    link.note("bench.opened", {}, bench_file=str(tmp_path / "gone.toml"))
    link.close()
    assert longest_safe_s(settings) == 60.0


@pytest.mark.parametrize(("safe_s", "limit_s"), [(60.0, 65.0), (0.0, 10.0)])
def test_a_worker_that_brakes_for_its_declared_time_is_not_killed_and_a_silent_one_is_after_10_s(
    tmp_path: Path, safe_s: float, limit_s: float
) -> None:
    killed_s = killed_after_s(tmp_path, hung_after_s(safe_s), beats=True)
    assert killed_s is not None
    assert limit_s < killed_s <= limit_s + 2 * STEP_S, "it counts from the first look that found it, and looks late"
    silent_s = killed_after_s(tmp_path, hung_after_s(safe_s), beats=False)
    assert silent_s is not None
    assert 10.0 < silent_s <= 10.0 + 3 * STEP_S
