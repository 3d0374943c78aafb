"""A stop from another host: what the supervisor's listener takes, and everything that it does not."""

import json
import socket
from collections.abc import Generator
from contextlib import suppress
from pathlib import Path

import pytest

from bench_service.bench.stop import listener as stop_listener
from bench_service.bench.stop.channel import StopChannel
from bench_service.bench.stop.listener import CONNECTIONS, StopListener
from bench_service.bench.stop.messages import Listening, made_secret, proof, read_secret
from bench_service.bench.stop.other_hosts import ListenerRoute, StopAddresses
from bench_service.bench.stop.routes import Sent, StopRoutes
from bench_service.bench.stop.word import StopWord
from bench_service.model.errors import StorageFailure
from bench_service.wall_clock import monotonic_s, pause
from tests.kit.busy_machine import BUSY_S

SECRET = b"a secret that is long enough"


@pytest.fixture
def channel(tmp_path: Path) -> StopChannel:
    made = StopChannel(tmp_path, "sim")
    made.prepare()
    return made


@pytest.fixture
def listener(channel: StopChannel) -> Generator[StopListener]:
    made = StopListener("127.0.0.1:0", SECRET, channel, lambda: bool(channel.standing()))
    made.begin()
    deadline = monotonic_s() + 10
    while made.listening() is None:
        assert monotonic_s() < deadline
        pause(0.01)
    yield made
    made.end()


def at(listener: StopListener) -> Listening:
    found = listener.listening()
    assert found is not None
    return found


def test_a_stop_is_taken_and_its_answer_is_believed(listener: StopListener, channel: StopChannel) -> None:
    word = StopWord("smoke", "Olena", "http")
    safety = ListenerRoute("sim", at(listener), SECRET).ask(word).safety
    assert safety is not None
    assert safety.safe is True
    assert "the devices are safe" in safety.explanation
    assert [(one.id, one.reason, one.by, one.via) for one in channel.standing()] == [
        (word.id, "smoke", "Olena", "listener")
    ]


@pytest.mark.parametrize("bench", ["sim", "another"])
def test_without_the_secret_or_for_another_bench_nothing_is_taken(
    listener: StopListener, channel: StopChannel, bench: str
) -> None:
    secret = b"another secret, also long enough" if bench == "sim" else SECRET
    assert ListenerRoute(bench, at(listener), secret).ask(StopWord("smoke", "Olena", "http")) == Sent(False)
    assert channel.standing() == ()


def connected(listener: StopListener) -> tuple[socket.socket, dict]:
    host, _, port = at(listener).address.rpartition(":")
    made = socket.create_connection((host, int(port)), 5)
    made.settimeout(5)
    return made, json.loads(made.makefile().readline())


def test_a_stop_that_was_listened_in_to_cannot_be_sent_again(listener: StopListener, channel: StopChannel) -> None:
    first, hello = connected(listener)
    text = json.dumps({**StopWord("smoke", "Olena", "http").document(), "bench": "sim"})
    line = json.dumps(
        {"number": "mine", "text": text, "proof": proof(SECRET, "stop", (hello["number"], "mine"), text)}
    ).encode()
    first.sendall(line + b"\n")
    assert json.loads(first.makefile().readline())["proof"]
    first.close()
    (word,) = channel.standing()
    channel.clear([word.id])
    second, _ = connected(listener)
    second.sendall(line + b"\n")
    assert second.makefile().readline() == ""
    second.close()
    assert channel.standing() == ()


@pytest.mark.parametrize("line", [b"\n", b"{}\n", b"[1]\n", b"x" * 20_000 + b"\n", b'{"text": 1, "proof": 2}\n'])
def test_what_is_no_message_ends_its_connection_and_nothing_else(
    listener: StopListener, channel: StopChannel, line: bytes
) -> None:
    bad, _ = connected(listener)
    bad.sendall(line)
    with suppress(ConnectionResetError):  # it was closed before all of it was read
        assert bad.recv(100) == b""
    bad.close()
    assert channel.standing() == ()
    assert ListenerRoute("sim", at(listener), SECRET).ask(StopWord("smoke", "Olena", "http")).taken


def test_idle_connections_keep_no_stop_out(listener: StopListener, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(stop_listener, "MESSAGE_S", 120.0)  # so long they would keep it out
    idle = [connected(listener)[0] for _ in range(2 * CONNECTIONS)]
    begun_s = monotonic_s()
    assert ListenerRoute("sim", at(listener), SECRET).ask(StopWord("smoke", "Olena", "http")).taken
    assert monotonic_s() - begun_s < BUSY_S
    for each in idle:
        each.close()


def test_a_listener_that_lies_about_the_bench_is_not_believed(channel: StopChannel) -> None:
    with socket.create_server(("127.0.0.1", 0)) as server:
        host, port = server.getsockname()
        from threading import Thread

        def lie() -> None:
            connection, _ = server.accept()
            with connection:
                connection.sendall(b'{"bench": "sim", "number": "1"}\n')
                connection.recv(10_000)
                text = json.dumps({"taken": True, "safe": True, "state": "safe", "host": "x"})
                connection.sendall(json.dumps({"text": text, "proof": "00"}).encode() + b"\n")

        thread = Thread(target=lie)
        thread.start()
        assert ListenerRoute("sim", Listening(f"{host}:{port}", "x"), SECRET).ask(StopWord("a", "b", "http")) == Sent(
            False
        )
        thread.join()


def test_addresses_are_kept_while_the_database_is_away(tmp_path: Path) -> None:
    answers: list[dict[str, Listening] | None] = [{"sim": Listening("127.0.0.1:1", "bench-host")}, None]

    def read() -> dict[str, Listening]:
        found = answers.pop(0) if len(answers) > 1 else answers[0]
        if found is None:
            raise StorageFailure("away")
        return found

    secret = tmp_path / "secret"
    addresses = StopAddresses(read, secret)
    addresses.begin()
    deadline = monotonic_s() + 10
    while addresses.host("sim") != "bench-host":
        assert monotonic_s() < deadline
        pause(0.01)
    assert addresses.route("sim") is None, "there is no secret yet"
    assert made_secret(secret) == made_secret(secret) == read_secret(secret)
    assert secret.stat().st_mode & 0o077 == 0
    assert addresses.route("sim") is not None
    assert addresses.route("another") is None
    addresses.end()
    secret.write_text("short")
    assert read_secret(secret) is None


def test_where_the_channel_of_this_host_takes_nothing_the_listener_is_asked(
    listener: StopListener, channel: StopChannel, tmp_path: Path
) -> None:
    """As where the device folder belongs to another user: here the file cannot be opened, and nobody has a socket."""
    folder = tmp_path / "another's"
    (folder / "bench-sim.stop").mkdir(parents=True)
    word = StopWord("smoke", "Olena", "http")
    nobody, somebody = (
        StopRoutes(folder).to("sim"),
        StopRoutes(folder, lambda bench: ListenerRoute(bench, at(listener), SECRET)).to("sim"),
    )
    assert nobody is not None
    assert somebody is not None
    assert nobody.here
    assert nobody.ask(word) == Sent(False)
    assert channel.standing() == ()
    assert somebody.ask(word).taken
    assert [one.id for one in channel.standing()] == [word.id]
