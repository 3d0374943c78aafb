"""Databases and hosts that cannot be reached, in a stop's way: put there while the table moves."""

import os
import socket
import subprocess
import threading
import time
from collections.abc import Generator, Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

import sqlalchemy as sa

from tests.chaos.databases import OwnPostgres, database
from tests.chaos.stop_bench import StopBench
from tests.chaos.stop_hindrances import NotHere
from tests.database_away import Port, hung


@contextmanager
def postgres_bench(folder: Path, **how: object) -> Generator[tuple[StopBench, OwnPostgres]]:
    """API and worker apart on a Postgres of their own."""
    with database("postgres", folder) as server:
        assert isinstance(server, OwnPostgres)
        bench = StopBench(folder, server.url, apart=True, **how)  # type: ignore[arg-type]
        try:
            bench.start()
            yield bench, server
        finally:
            bench.end()


@contextmanager
def postgres_refuses(folder: Path) -> Iterator[StopBench]:
    """Its port is closed, as that of a server which crashed."""
    with database("postgres", folder) as server:
        assert isinstance(server, OwnPostgres)
        port = Port(server.url)
        bench = StopBench(folder, port.url, apart=True)
        try:
            bench.start()
            bench.submit()
            bench.until_it_moves()
            port.cut()
            yield bench
        finally:
            bench.end()


@contextmanager
def postgres_hangs(folder: Path) -> Iterator[StopBench]:
    with postgres_bench(folder) as (bench, server):
        bench.submit()
        bench.until_it_moves()
        with hung(server.data):
            yield bench


class Wire:
    """A TCP port in front of a Postgres' Unix socket, which can be cut: then nothing passes, and nothing is said."""

    def __init__(self, target: str) -> None:
        self._target = target
        self._server = socket.create_server(("127.0.0.1", 0))
        self.port = self._server.getsockname()[1]
        self.cut = threading.Event()
        self._open: list[socket.socket] = []
        threading.Thread(target=self._run, daemon=True).start()

    def _run(self) -> None:
        with suppress(OSError):
            while True:
                near, _ = self._server.accept()
                self._open.append(near)
                if self.cut.is_set():
                    continue  # it is connected, and nobody answers
                far = socket.socket(socket.AF_UNIX)
                far.connect(self._target)
                self._open.append(far)
                for ends in ((near, far), (far, near)):
                    threading.Thread(target=self._pass, args=ends, daemon=True).start()

    def _pass(self, one: socket.socket, other: socket.socket) -> None:
        with suppress(OSError):
            while piece := one.recv(65536):
                if self.cut.is_set():
                    return
                other.sendall(piece)

    def close(self) -> None:
        for each in (self._server, *self._open):
            with suppress(OSError):
                each.shutdown(socket.SHUT_RDWR)
            each.close()


@contextmanager
def postgres_gone_over_tcp(folder: Path) -> Iterator[StopBench]:
    with database("postgres", folder) as server:
        assert isinstance(server, OwnPostgres)
        behind = sa.make_url(server.url)
        wire = Wire(f"{behind.query['host']}/.s.PGSQL.{behind.port or 5432}")
        through = behind.set(host="127.0.0.1", port=wire.port, query={}).render_as_string(hide_password=False)
        bench = StopBench(folder, through, apart=True)
        try:
            bench.start()
            bench.submit()
            bench.until_it_moves()
            wire.cut.set()
            yield bench
        finally:
            bench.end()
            wire.close()


@contextmanager
def api_on_another_host(folder: Path) -> Iterator[StopBench]:
    """The bench in a network of its own and with a device folder of its own, the database not answering."""
    name = f"stop{os.getpid() % 10000}"
    near, far = f"n{name}", f"f{name}"
    steps = (
        f"ip netns add {name}",
        f"ip link add {near} type veth peer name {far}",
        f"ip link set {far} netns {name}",
        f"ip addr add 10.213.7.1/30 dev {near}",
        f"ip link set {near} up",
        f"ip netns exec {name} ip addr add 10.213.7.2/30 dev {far}",
        f"ip netns exec {name} ip link set {far} up",
        f"ip netns exec {name} ip link set lo up",
    )
    try:
        for step in steps:
            made = subprocess.run(step.split(), capture_output=True, text=True, check=False)
            if made.returncode != 0:
                raise NotHere(f"no network namespace here: {step}: {made.stderr.strip()}")
        (folder / "elsewhere").mkdir()
        secret = folder / "stop.secret"
        secret.write_text("a secret of this run alone, and long enough\n")
        both = {"BENCH_STOP_SECRET_FILE": str(secret), "BENCH_STOP_LISTEN": "10.213.7.2:8700"}
        api = {"BENCH_DEVICE_FOLDER": str(folder / "elsewhere")}
        prefix = ("ip", "netns", "exec", name)
        with postgres_bench(folder, settings=both, api_settings=api, worker_prefix=prefix) as (bench, server):
            bench.submit()
            bench.until_it_moves()
            time.sleep(2.5)  # the API has learned the address by then
            if not bench.moves():
                bench.until_it_moves()
            with hung(server.data):
                yield bench
    finally:
        subprocess.run(["ip", "netns", "del", name], capture_output=True, check=False)
        subprocess.run(["ip", "link", "del", near], capture_output=True, check=False)
