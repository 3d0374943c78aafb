"""The way of a stop to a bench of another host: over the listener of its supervisor, by an address kept in memory."""

import json
import logging
import socket
from collections.abc import Callable, Mapping
from pathlib import Path
from threading import Event, Thread

from bench_service.bench.safety import Safety
from bench_service.bench.stop.messages import (
    BadMessage,
    Listening,
    check,
    new_number,
    proof,
    read_secret,
    receive_line,
    send_line,
    split_address,
)
from bench_service.bench.stop.routes import Sent
from bench_service.bench.stop.word import StopWord
from bench_service.model.errors import ServiceError
from bench_service.wall_clock import monotonic_s

CONNECT_S = 1.0
ANSWER_S = 2.5
"""Time limit of the whole exchange [s]."""
LEARN_S = 2.0
"""Interval at which the addresses are read while the database answers [s]."""

log = logging.getLogger(__name__)


class ListenerRoute:
    """The route of a stop to a bench of another host, over TCP to the listener of its supervisor. Implements
    `StopRoute`.
    """

    here = False

    def __init__(self, bench_id: str, at: Listening, secret: bytes) -> None:
        self._bench_id = bench_id
        self._at = at
        self._secret = secret

    def ask(self, word: StopWord) -> Sent:
        """Send the stop request to the supervisor and wait for its answer, within a time limit; not taken where it
        cannot be reached, or refuses.
        """
        try:
            found = self._exchange(word)
        except (BadMessage, OSError, ValueError, KeyError) as error:
            log.warning("the supervisor of bench %s at %s: %s", self._bench_id, self._at.address, error)
            return Sent(False)
        if not found["taken"]:
            return Sent(False)
        state = "the devices are safe" if found["safe"] else "the devices are NOT safe yet"
        text = f"The bench's supervisor on host {found['host']} has the stop ({found['state']}); {state}."
        return Sent(True, Safety(bool(found["safe"]), text, None, None, None))

    def _exchange(self, word: StopWord) -> dict[str, object]:
        by_s = monotonic_s() + ANSWER_S
        with socket.create_connection(split_address(self._at.address), CONNECT_S) as connection:
            hello = receive_line(connection, by_s)
            numbers = (str(hello["number"]), new_number())
            text = json.dumps({**word.document(), "bench": self._bench_id})
            send_line(
                connection,
                {"number": numbers[1], "text": text, "proof": proof(self._secret, "stop", numbers, text)},
            )
            return json.loads(check(self._secret, "answer", numbers, receive_line(connection, by_s)))


class StopAddresses:
    """Keeps the addresses of all supervisors' listeners in memory, in a thread that reads them again and again while
    the database answers.
    """

    def __init__(self, read: Callable[[], Mapping[str, Listening]], secret_file: Path) -> None:
        """Set up with `read`, which asks the database for the addresses and raises `ServiceError`."""
        self._read = read
        self._secret_file = secret_file
        self._known: dict[str, Listening] = {}
        self._ending = Event()
        self._thread = Thread(target=self._run, name="stop addresses", daemon=True)

    def begin(self) -> None:
        """Start the thread that reads the addresses."""
        self._thread.start()

    def end(self) -> None:
        """Stop reading the addresses; a thread that hangs in the database ends with the process."""
        self._ending.set()
        self._thread.join(LEARN_S)

    def route(self, bench_id: str) -> ListenerRoute | None:
        """Return the route to a bench of another host; None where its address or the secret is not known here."""
        at, secret = self._known.get(bench_id), read_secret(self._secret_file)
        return None if at is None or secret is None else ListenerRoute(bench_id, at, secret)

    def host(self, bench_id: str) -> str:
        """Return the name of a bench's host; empty where it is not known."""
        at = self._known.get(bench_id)
        return "" if at is None else at.host

    def _run(self) -> None:
        while True:
            try:
                self._known |= self._read()  # a supervisor without a row now keeps the address that it had
            except ServiceError:
                pass
            except Exception:
                log.exception("the addresses of supervisors")
            if self._ending.wait(LEARN_S):
                return
