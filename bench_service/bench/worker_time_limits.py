"""Time limits that a supervisor sets a worker with the devices' link: one that leaves a stop unanswered, gives no
heartbeat while its bench is not safe, or has seen a stop and does not get the bench safe.

Delays are summed look by look on the supervisor's own clock, so neither a clock that jumps nor a supervisor that was
held up itself makes a worker late.
"""

from math import inf

from bench_service.bench.heartbeat import COUNTED_S, HeartbeatFile
from bench_service.bench.processes import ProcessIdentity
from bench_service.bench.stop.channel import WORKER, StopChannel

SILENT_S = 10.0
"""Time without a heartbeat after which a worker is killed, while its bench is not safe [s]."""
UNANSWERED_S = 3.0
"""Time that a worker may leave a stop unanswered, while it has the devices' link, before it is killed [s]."""
HUNG_S = 10.0
"""Shortest time that a worker is given from seeing a stop until the bench is safe, before it is killed [s]."""
MARGIN_S = 5.0
"""Added to the declared time of the slowest device [s]: the worker first abandons its work, and reads the devices back
afterwards."""
ENDING_S = 20.0
"""Shortest time that a service that ends waits for its bench to be safe [s]."""


def hung_after_s(safe_s: float) -> float:
    """Time that a worker is given from seeing a stop until the bench is safe [s].

    `safe_s`: the longest time that a device of the bench is declared to need; 0 where none is declared. A worker that
    is killed while a table brakes for its declared 60 s would leave it in mid-braking.
    """
    return max(HUNG_S, safe_s + MARGIN_S)


def ending_s(safe_s: float) -> float:
    """Time that a service that ends waits for its bench to be safe [s]; `safe_s` as for `hung_after_s`."""
    return max(ENDING_S, safe_s + 2.0 * MARGIN_S)


class WorkerTimeLimits:
    """Measures how long the worker has been overdue on one bench, against the time limits; the supervisor asks it at
    each look.
    """

    def __init__(
        self, channel: StopChannel, heartbeat: HeartbeatFile, unanswered_s: float, hung_s: float, silent_s: float
    ) -> None:
        self._channel = channel
        self._heartbeat = heartbeat
        self._limits_s = {"unanswered": unanswered_s, "hung": hung_s, "silent": silent_s}
        self._held_s: dict[str, float | None] = dict.fromkeys(self._limits_s)
        """Duration of each delay so far, from the first look that found it."""
        self._looked_s = inf
        self._beat = 0

    def reset(self, now_s: float) -> None:
        """Reset all delays to zero."""
        self._held_s = dict.fromkeys(self._limits_s)
        self._looked_s = now_s

    def over(
        self, now_s: float, worker: ProcessIdentity, words: frozenset[str], stopped: bool, safe: bool = False
    ) -> str | None:
        """The reason to kill the worker, which has its devices' link; None: not yet.

        `words`: the stops in the channel; `stopped`: True where the bench is, by them or by the database. `safe`: True
        while the devices are; then only a stop without an answer counts. A worker that was suspended would command them
        when it continues, and nobody could say meanwhile that the bench is safe.
        """
        passed_s = min(max(now_s - self._looked_s, 0.0), COUNTED_S)
        self._looked_s = now_s
        beat = self._heartbeat.last(worker)
        silent, self._beat = beat == self._beat, beat
        unanswered = bool(words - self._channel.answered(WORKER).seen)
        for name, holds in (
            ("silent", silent and not safe),
            ("unanswered", unanswered),
            ("hung", stopped and not safe),
        ):
            since = self._held_s[name] if holds else None  # None: it did not hold at the look before
            self._held_s[name] = None if not holds else 0.0 if since is None else since + passed_s
        return next((self._why(name) for name, held_s in self._held_s.items() if self._too_long(name, held_s)), None)

    def _too_long(self, name: str, held_s: float | None) -> bool:
        return held_s is not None and held_s > self._limits_s[name]

    def _why(self, name: str) -> str:
        limit_s = self._limits_s[name]
        return {
            "unanswered": f"did not answer a stop for {limit_s:g} s",
            "hung": f"has seen a stop and has not made the bench safe within {limit_s:g} s",
            "silent": f"gave no heartbeat for {limit_s:g} s",
        }[name]
