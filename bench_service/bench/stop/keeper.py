"""Keeps the stop channel and the database in step for a driven bench, in a thread that may hang in the database."""

import logging
from threading import Event, Thread

from bench_service.bench.stop.channel import StopChannel
from bench_service.bench.stop.exchange import StopBooks, StopExchange
from bench_service.model.errors import ServiceError

KEEP_S = 1.0
"""Interval between two comparisons of channel and database [s]."""

log = logging.getLogger(__name__)


class StopKeeper:
    """Runs the exchange between stop channel and database for one driven bench in a thread, so that its stops reach the
    database without a supervisor too.
    """

    def __init__(self, channel: StopChannel, books: StopBooks) -> None:
        self._bench_id = channel.bench_id
        self._exchange = StopExchange(channel, books)
        self._ending = Event()
        self._said = ""
        self._thread = Thread(target=self._run, name="stop keeper", daemon=True)

    def begin(self) -> None:
        """Start the thread that compares channel and database."""
        self._thread.start()

    def end(self) -> None:
        """Stop comparing channel and database; a thread that hangs in the database ends with the process."""
        self._ending.set()
        self._thread.join(KEEP_S)

    def _run(self) -> None:
        while not self._ending.wait(KEEP_S):
            try:
                self._exchange.exchange()
                self._said = ""
            except ServiceError as error:
                if str(error) != self._said:
                    log.warning("the stops of bench %s are not compared with the database: %s", self._bench_id, error)
                self._said = str(error)
            except Exception:  # a stop's entry into the database may be late, but is never given up
                log.exception("the stop keeper of bench %s", self._bench_id)
