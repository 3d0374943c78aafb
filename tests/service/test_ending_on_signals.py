"""SIGTERM and SIGHUP end a server in order, whenever they come; `nohup` is respected."""

import os
import signal
import threading
from collections.abc import AsyncGenerator, Callable, Generator
from contextlib import asynccontextmanager, contextmanager
from unittest.mock import MagicMock

import pytest
import uvicorn
from fastapi import FastAPI

from bench_service.cli import demo as cli_demo
from bench_service.cli.groups import services
from bench_service.cli.processes import companion, serving
from bench_service.cli.processes.ending import calling_at_end, ending_on_signals
from bench_service.settings import Settings
from bench_service.wall_clock import pause

SIGNALS = [signal.SIGTERM, signal.SIGHUP]


@pytest.fixture(autouse=True)
def handlers() -> Generator[None]:
    """Handlers as of a process at a terminal, whatever the suite runs under."""
    before = {number: signal.signal(number, signal.SIG_DFL) for number in (*SIGNALS, signal.SIGINT)}
    yield
    for number, handler in before.items():
        signal.signal(number, handler)


@pytest.fixture
def ends(monkeypatch: pytest.MonkeyPatch) -> list[str]:
    """Ends that a service around a server without routes has seen, in order."""
    seen: list[str] = []

    @asynccontextmanager
    async def lifespan(_: FastAPI) -> AsyncGenerator[None]:
        yield
        seen.append("shut down")

    @contextmanager
    def opened(*_: object) -> Generator[tuple[uvicorn.Server, MagicMock, MagicMock]]:
        if "early" in seen:
            os.kill(os.getpid(), signal.SIGHUP)
        app = FastAPI(lifespan=lifespan)
        started = MagicMock(**{"failed_start.return_value": None, "failure.return_value": None})
        yield serving._Server(uvicorn.Config(app, port=0, log_config=None)), started, started
        os.kill(os.getpid(), signal.SIGHUP)  # as terminal and shell do: both send one
        os.kill(os.getpid(), signal.SIGTERM)
        seen.append("closed")

    monkeypatch.setattr(serving, "_opened", opened)
    return seen


def send_once_started(server: uvicorn.Server, number: signal.Signals) -> None:
    while not server.started:
        pause(0.001)
    os.kill(os.getpid(), number)


@pytest.mark.parametrize("number", SIGNALS)
def test_a_server_shuts_down_in_order_and_no_second_signal_interrupts_its_closing(
    ends: list[str], number: signal.Signals
) -> None:
    with serving.ready(Settings()) as server:
        sending = threading.Thread(target=send_once_started, args=(server, number))
        sending.start()
        server.run()
        sending.join()
    assert ends == ["shut down", "closed"]
    assert [signal.getsignal(n) for n in SIGNALS] == [signal.SIG_DFL] * 2


def test_a_signal_that_comes_while_the_service_is_opened_ends_it_once_it_runs(ends: list[str]) -> None:
    ends.append("early")
    with serving.ready(Settings()) as server:
        server.run()
    assert ends == ["early", "shut down", "closed"]


def test_nohup_stays(ends: list[str]) -> None:
    signal.signal(signal.SIGHUP, signal.SIG_IGN)
    with serving.ready(Settings()) as server:
        os.kill(os.getpid(), signal.SIGHUP)
        assert not server.should_exit
        server.should_exit = True
    event = ending_on_signals()
    os.kill(os.getpid(), signal.SIGHUP)
    assert not event.is_set()
    assert signal.getsignal(signal.SIGHUP) == signal.SIG_IGN
    os.kill(os.getpid(), signal.SIGTERM)
    assert event.is_set()


@pytest.mark.parametrize("number", [*SIGNALS, signal.SIGINT])
def test_a_worker_ends_on_each(number: signal.Signals) -> None:
    event = ending_on_signals()
    os.kill(os.getpid(), number)
    assert event.is_set()


def test_a_thread_leaves_the_signals_alone() -> None:
    def work() -> None:
        with calling_at_end(lambda: None):
            found.append(signal.getsignal(signal.SIGHUP))

    found: list[object] = []
    thread = threading.Thread(target=work)
    thread.start()
    thread.join()
    assert found == [signal.SIG_DFL]


def test_the_demonstration_leaves_its_supervisor_once_the_bench_is_safe(monkeypatch: pytest.MonkeyPatch) -> None:
    """In this order: no supervisor is started any more, the service makes its bench safe, the supervisor is left."""
    seen: list[str] = []
    driving: list[Callable[[], bool]] = []

    @contextmanager
    def serves(_: Settings) -> Generator[None]:
        yield
        seen.append(f"safe, supervisor {'restarted' if driving[0]() else 'not restarted'} if it ends")
        os.kill(os.getpid(), signal.SIGTERM)  # a second one, as from `make` and the shell, interrupts nothing

    @contextmanager
    def accompanies(_: Settings, drives: Callable[[], bool]) -> Generator[None]:
        driving.append(drives)
        assert not drives()
        yield
        seen.append("supervisor left")

    @contextmanager
    def answers(*_: object, **__: object) -> Generator[None]:
        yield

    def demonstrated(*_: object) -> int:
        assert driving[0]()
        threading.Timer(0.05, os.kill, (os.getpid(), signal.SIGTERM)).start()
        return 0

    for place, name, stand_in in (
        (serving, "serving", serves),
        (serving, "check_port", lambda _: None),
        (companion, "accompanied", accompanies),
        (services, "connect", answers),
        (cli_demo, "demonstrate", demonstrated),
    ):
        monkeypatch.setattr(place, name, stand_in)
    assert services.demo(MagicMock(obj=Settings())) == 0
    assert seen == ["safe, supervisor not restarted if it ends", "supervisor left"]
