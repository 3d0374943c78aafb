"""The supervisor's listener: it enters a stop from an API on another host into the bench's channel.

It can do nothing else: it releases no stop, and discloses only whether the bench is safe. Connections are few
and short; beyond their limit, the oldest is closed.
"""

import json
import logging
import socket
from collections.abc import Callable
from threading import Event, Lock, Thread

from bench_service.bench.processes import HOST
from bench_service.bench.stop.channel import StopChannel
from bench_service.bench.stop.messages import (
    BadMessage,
    Listening,
    check,
    new_number,
    proof,
    receive_line,
    send_line,
    split_address,
)
from bench_service.bench.stop.word import StopWord
from bench_service.wall_clock import monotonic_s, now, pause

CONNECTIONS = 16
"""Maximum number of connections at once; one more closes the oldest."""
MESSAGE_S = 2.0
"""Time that a connection may take to send its message [s]."""
SAFE_S = 1.0
"""Time that an answer waits for the bench to be safe [s]."""
AGAIN_S = 1.0
"""Interval between two attempts to bind an address that is not available [s]."""

log = logging.getLogger(__name__)


class StopListener:
    """TCP server of a supervisor that takes stops for one bench from other hosts, in threads of its own."""

    def __init__(self, address: str, secret: bytes, channel: StopChannel, is_safe: Callable[[], bool]) -> None:
        """Set up to listen at `address`: `host:port`, port 0 for any. Raises `ValueError` for any other text."""
        self._wanted = split_address(address)
        self._secret = secret
        self._channel = channel
        self._is_safe = is_safe
        self._ending = Event()
        self._mutex = Lock()
        self._open: list[socket.socket] = []
        self._socket: socket.socket | None = None

    def begin(self) -> None:
        """Start the thread that binds the address, as soon as it can be bound, and takes connections."""
        Thread(target=self._run, name="stop listener", daemon=True).start()

    def listening(self) -> Listening | None:
        """Return the address at which it listens now; None where it does not."""
        listening = self._socket
        if listening is None:
            return None
        name = HOST if self._wanted[0] in ("0.0.0.0", "::") else self._wanted[0]
        return Listening(f"{name}:{listening.getsockname()[1]}", HOST)

    def end(self) -> None:
        """Stop listening, and close all connections."""
        self._ending.set()
        with self._mutex:
            for each in (*self._open, *([] if self._socket is None else [self._socket])):
                _shut(each)

    def _run(self) -> None:
        said = False
        while not self._ending.is_set():
            try:
                with socket.create_server(self._wanted, backlog=64) as made:
                    self._socket, said = made, False
                    log.info("stops of bench %s are accepted at %s", self._channel.bench_id, made.getsockname())
                    self._accept(made)
            except OSError as error:
                if not said and not self._ending.is_set():
                    log.warning(
                        "stops of bench %s are not accepted at %s: %s", self._channel.bench_id, self._wanted, error
                    )
                said = True
            self._socket = None
            self._ending.wait(AGAIN_S)

    def _accept(self, listening: socket.socket) -> None:
        while not self._ending.is_set():
            connection, _ = listening.accept()
            with self._mutex:
                self._open.append(connection)
                if len(self._open) > CONNECTIONS:
                    _shut(self._open.pop(0))
            Thread(target=self._serve, args=(connection,), name="stop connection", daemon=True).start()

    def _serve(self, connection: socket.socket) -> None:
        try:
            self._answer(connection)
        except (BadMessage, OSError, ValueError, TypeError, KeyError) as error:
            log.warning("a stop of bench %s was not accepted: %s", self._channel.bench_id, error)
        finally:
            with self._mutex:
                if connection in self._open:
                    self._open.remove(connection)
            connection.close()

    def _answer(self, connection: socket.socket) -> None:
        own = new_number()
        connection.settimeout(MESSAGE_S)
        send_line(connection, {"bench": self._channel.bench_id, "number": own})
        message = receive_line(connection, monotonic_s() + MESSAGE_S)
        numbers = (own, str(message.get("number", ""))[:64])
        asked = json.loads(check(self._secret, "stop", numbers, message))
        if asked.pop("bench") != self._channel.bench_id:
            raise BadMessage("the message is meant for another bench")
        word = StopWord.of({**asked, "at": now().isoformat(), "via": "listener", "booked": False})
        taken = self._channel.ask(word)
        deadline = monotonic_s() + SAFE_S
        while not (safe := self._is_safe()) and monotonic_s() < deadline:
            pause(0.02)
        text = json.dumps({"taken": taken, "safe": safe, "state": self._channel.state(word.id), "host": HOST})
        connection.settimeout(MESSAGE_S)
        send_line(connection, {"text": text, "proof": proof(self._secret, "answer", numbers, text)})


def _shut(connection: socket.socket) -> None:
    """Close a connection that another thread may wait for."""
    try:
        connection.shutdown(socket.SHUT_RDWR)
    except OSError:
        return
