"""What stop channel and database tell one another: each stop ends up in both, and a release in both takes it away.

The channel comes first and needs nothing; the books follow when they can, and say when they were late. Called again and
again, in a thread that may hang in the database, by the supervisor and by the process that drives the bench: entering a
stop twice, or taking it away twice, changes nothing.
"""

from typing import Protocol

from bench_service.bench.stop.channel import StopChannel
from bench_service.bench.stop.word import StopWord
from bench_service.model.records import BenchStop

LATE_S = 2.0
"""A stop that is entered later than this after it was asked for is noted as late [s]."""


class StopBooks(Protocol):
    """What is read and written in the database. Every verb raises `ServiceError` if it does not answer."""

    def standing(self) -> tuple[BenchStop, ...]:
        """The stops that keep the bench from working."""
        ...

    def enter(self, word: StopWord) -> None:
        """Enter a stop that came by the channel; repeated with the same id it changes nothing."""
        ...


class StopExchange:
    """Between the channel of one bench and the books. For one thread."""

    def __init__(self, channel: StopChannel, books: StopBooks) -> None:
        self._channel = channel
        self._books = books
        self._last: frozenset[str] = frozenset()
        self._mirrored: set[str] = set()
        self.stopped = False
        """Whether the books said so last."""

    def exchange(self) -> None:
        """Enter what the books lack, take away what was released, say what only the books knew. Raises `ServiceError`.

        A stop that is seen in the books alone is said in the channel at the second look: at the first one it may have
        been released by now, and its word been taken away.
        """
        words = self._channel.standing()
        for word in words:
            if not word.booked:
                self._books.enter(word)
                self._channel.mark_booked([word.id])
        standing = {stop.id: stop for stop in self._books.standing()}
        self._channel.clear(word.id for word in words if word.booked and word.id not in standing)
        known = self._mirrored | {word.id for word in words}
        for stop_id in (standing.keys() & self._last) - known:
            stop = standing[stop_id]
            self._channel.ask(StopWord(stop.reason, stop.by, "books", stop.id, stop.at, booked=True))
            self._mirrored.add(stop_id)
        self._mirrored &= standing.keys()
        self._last = frozenset(standing)
        self.stopped = bool(standing)
