"""Ways in which a Postgres is away: its port refuses, or its processes hang. Real ones, of the test's own."""

import os
import signal
import socket
import subprocess
from collections.abc import Generator
from contextlib import contextmanager, suppress
from pathlib import Path
from threading import Lock, Thread

import pytest
import sqlalchemy as sa

from bench_service.persistence.database import TCP


class Port:
    """A loopback TCP port in front of a server's Unix socket, which can be cut and opened again."""

    def __init__(self, url: str) -> None:
        """`url`: of a database that is reached over a Unix socket."""
        behind = sa.make_url(url)
        self._socket = f"{behind.query['host']}/.s.PGSQL.{behind.port or 5432}"
        self._mutex = Lock()
        self._ends: set[socket.socket] = set()
        self._listener: socket.socket | None = None
        self._port = 0
        self.open()
        self.url = behind.set(host="127.0.0.1", port=self._port, query={}).render_as_string(hide_password=False)

    def open(self) -> None:
        """Listen, on the same port as before."""
        listener = socket.create_server(("127.0.0.1", self._port))
        self._port = listener.getsockname()[1]
        self._listener = listener
        Thread(target=self._accept, args=(listener,), daemon=True).start()

    def cut(self) -> None:
        """Close what is open, and refuse what comes."""
        with self._mutex:
            listener, self._listener = self._listener, None
            ends, self._ends = self._ends, set()
        if listener is not None:
            listener.shutdown(socket.SHUT_RDWR)  # wakes who accepts: only then the port is free
            listener.close()
        for end in ends:
            _close(end)

    def _accept(self, listener: socket.socket) -> None:
        while True:
            try:
                client = listener.accept()[0]
            except OSError:
                return
            server = socket.socket(socket.AF_UNIX)
            server.connect(self._socket)
            with self._mutex:
                if self._listener is not listener:
                    _close(client)
                    _close(server)
                    return
                self._ends |= {client, server}
            for ends in ((client, server), (server, client)):
                Thread(target=_pump, args=ends, daemon=True).start()


def _pump(source: socket.socket, sink: socket.socket) -> None:
    try:
        while data := source.recv(65536):
            sink.sendall(data)
    except OSError:
        pass
    _close(source)
    _close(sink)


def _close(end: socket.socket) -> None:
    with suppress(OSError):  # closed by the other side
        end.shutdown(socket.SHUT_RDWR)
    end.close()


@contextmanager
def connections_that_wait() -> Generator[None]:
    """Engines that are made meanwhile wait for a server that hangs, not ten seconds for each new connection.

    So what waits for the database is told from what does not, on a busy machine too.
    """
    with pytest.MonkeyPatch.context() as changed:
        changed.setitem(TCP, "connect_timeout", 300)
        yield


@contextmanager
def hung(data: Path) -> Generator[None]:
    """All processes of the Postgres that has its data in a folder are stopped, and go on at the end."""
    postmaster = int((data / "postmaster.pid").read_text().splitlines()[0])
    os.kill(postmaster, signal.SIGSTOP)  # first: it makes no more children
    listed = subprocess.run(["ps", "-o", "pid=", "--ppid", str(postmaster)], capture_output=True, text=True, check=True)
    processes = [postmaster, *map(int, listed.stdout.split())]
    try:
        for process in processes:
            os.kill(process, signal.SIGSTOP)
        yield
    finally:
        for process in processes:
            os.kill(process, signal.SIGCONT)
