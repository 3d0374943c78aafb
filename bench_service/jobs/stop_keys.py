"""Idempotency keys of stop requests, in the memory of this process: a stop may not wait for a database to look one up.

A stop that is sent again with its key, after a time-out or a broken connection, is the same stop. A key that comes with
another body, or long afterwards, is a stop of its own: a program whose button has one key for ever would be answered
that the bench is stopped, after its release, and nothing would stop. No stop is ever refused for its key.
"""

from collections import OrderedDict
from dataclasses import dataclass, field
from threading import Lock

from bench_service.bench.stop.word import StopWord
from bench_service.wall_clock import monotonic_s

MOST = 1000
"""Number of keys that are remembered, the latest ones."""
KEPT_S = 600.0
"""Time for which a key is remembered [s]: a client tries again within minutes."""


@dataclass
class KeyedStop:
    """The stop request of one idempotency key, and whether it was answered."""

    word: StopWord
    answered: bool = False
    at_s: float = field(default_factory=lambda: monotonic_s())
    """Time of the first request, by the monotonic clock [s]."""


class StopKeys:
    """The stop requests of the latest idempotency keys, in the memory of this process. For any thread."""

    def __init__(self) -> None:
        self._mutex = Lock()
        self._known: OrderedDict[tuple[str, str], KeyedStop] = OrderedDict()

    def of(self, bench_id: str, key: str | None, word: StopWord) -> KeyedStop:
        """Return the stop of a key where it is the same request, else the new one, remembered under the key."""
        new = KeyedStop(word)
        if key is None:
            return new
        with self._mutex:
            known = self._known.get((bench_id, key))
            same = known is not None and (known.word.reason, known.word.by) == (word.reason, word.by)
            if known is not None and same and new.at_s - known.at_s < KEPT_S:
                return known
            self._known[bench_id, key] = new
            while len(self._known) > MOST:
                self._known.popitem(last=False)
            return new
