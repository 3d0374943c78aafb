"""Synchronizes stop channel and database: each stop is entered in both, and a release in both removes it.

The channel comes first and needs nothing; the database follows, and records when it was late. A stop leaves the channel
only where the database has it as released. A database that does not know it at all was restored from an older copy, or
replaced: the stop is entered there again, and stands. Released stops are kept for ever, so a released one never comes
back that way.

Called again and again, in a thread that may hang in the database, by the supervisor and by the process that drives the
bench: entering a stop twice, or removing it twice, changes nothing.
"""

from collections.abc import Iterable, Mapping
from dataclasses import replace
from typing import Protocol

from bench_service.bench.stop.channel import StopChannel
from bench_service.bench.stop.word import StopWord
from bench_service.model.errors import TooManyStops
from bench_service.model.records import BenchStop

LATE_S = 2.0
"""Delay after which the entry of a stop is noted as late [s]."""


class StopBooks(Protocol):
    """The part of the database that holds the stops of one bench. Interface; every verb raises `ServiceError` if the
    database does not answer.
    """

    def standing(self) -> tuple[BenchStop, ...]:
        """Return the stops that keep the bench from working, oldest first."""
        ...

    def stored(self, ids: Iterable[str]) -> tuple[BenchStop, ...]:
        """Return, of the stops with these ids, those that the database has, standing or released."""
        ...

    def enter(self, word: StopWord) -> None:
        """Enter a stop that came by the channel; repeated with the same id it changes nothing."""
        ...


class StopExchange:
    """Brings the stop channel of one bench and the database into agreement. For use by one thread."""

    def __init__(self, channel: StopChannel, books: StopBooks) -> None:
        self._channel = channel
        self._books = books
        self._last: frozenset[str] = frozenset()
        self._mirrored: set[str] = set()
        self.stopped = False
        """True where the database last had a standing stop."""

    def exchange(self) -> None:
        """Enter stops that the database lacks, remove released ones, copy others to the channel. Raises `ServiceError`.

        A stop that is in the database alone is copied to the channel at the second look: at the first one it may have
        been released by now, and its request removed.
        """
        self._channel.replace_damaged()
        words = self._channel.standing()
        for word in words:
            if not word.booked and self._entered(word):
                self._channel.mark_booked([word.id])
        standing = {stop.id: stop for stop in self._books.standing()}
        self._compare([word for word in words if word.booked and word.id not in standing])
        known = self._mirrored | {word.id for word in words}
        for stop_id in (standing.keys() & self._last) - known:
            stop = standing[stop_id]
            self._channel.ask(StopWord(stop.reason, stop.by, "books", stop.id, stop.at, booked=True))
            self._mirrored.add(stop_id)
        self._mirrored &= standing.keys()
        self._last = frozenset(standing)
        self.stopped = bool(standing)

    def _compare(self, words: list[StopWord]) -> None:
        """Remove stops that the database has as released, and enter again those that it does not know."""
        if not words:
            return
        stored: Mapping[str, BenchStop] = {stop.id: stop for stop in self._books.stored(word.id for word in words)}
        for word in words:
            if word.id not in stored:
                self._entered(replace(word, restored=True))
        self._channel.clear(stop.id for stop in stored.values() if not stop.stands)

    def _entered(self, word: StopWord) -> bool:
        """Enter a stop; False where too many stand: it stays in the channel, and is entered once one is released."""
        try:
            self._books.enter(word)
        except TooManyStops:
            return False
        return True
