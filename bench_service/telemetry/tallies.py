"""A monitor's counts of jobs, from the database, because workers without HTTP make most of them.

Every API process gives the same numbers, also after a restart, so scrape one of them or take the maximum. A scrape
reads only jobs that have ended since the one before: those of the last `OVERLAP` again, because a commit on another
machine may come later than its time says. Among finished jobs, one that failed, was resumed and ended again counts as
both until the process restarts, then as the last; its stations count once.
"""

from bisect import bisect_left
from collections import Counter
from collections.abc import Mapping
from concurrent.futures import Future
from dataclasses import dataclass, field
from datetime import datetime, timedelta
from threading import Lock
from typing import Protocol

from bench_service.background import in_background
from bench_service.model.job import LEGAL, JobState
from bench_service.wall_clock import monotonic_s, now

NEVER_LEFT = tuple(state for state in JobState if not LEGAL[state])
"""States that no job leaves: it ends there once. A failed job may be resumed, and end again."""
OVERLAP = timedelta(seconds=60)
PAGE = 5000
RECORDINGS_S = 30.0
"""Age at which the sum over all recordings is made again [s]: it walks an index, apart from the scrapes."""
DURATION_S = (0.1, 0.3, 1.0, 3.0, 10.0, 30.0, 100.0, 300.0, 1e3, 3e3, 1e4, 3e4, 1e5, 3e5)
"""Upper ends of the buckets of durations and waits [s]; one more bucket has no upper end."""


@dataclass(frozen=True)
class Ending:
    """A job that has ended, as a row of the tally: procedure, state, verdict, times."""

    id: str
    procedure: str
    state: str
    verdict: str | None
    created_at: datetime
    started_at: datetime | None
    finished_at: datetime
    stations_done: int


class TallyStore(Protocol):
    """Reader of the rows that are counted for metrics. Interface; the SQL is in `persistence`."""

    def endings(self, since: datetime | None, after: str, limit: int) -> tuple[Ending, ...]:
        """Return at most `limit` jobs that ended at `since` with a greater id than `after`, or later; in that order."""
        ...

    def stations_of_open_jobs(self) -> Mapping[str, int]:
        """Return the number of stations done, by id of each job that has not ended and has done any."""
        ...

    def recorded_bytes(self) -> int:
        """Return the stored bytes of all recordings that are listed."""
        ...

    def free_bytes(self) -> int | None:
        """Return the free bytes on the disk of the database's file; None for a database of another machine."""
        ...


@dataclass
class Spread:
    """Histogram of durations in the classes of `DURATION_S`, with their sum [s]."""

    counts: list[int] = field(default_factory=lambda: [0] * (len(DURATION_S) + 1))
    sum_s: float = 0.0

    def add(self, seconds: float) -> None:
        """Add one duration [s]."""
        self.counts[bisect_left(DURATION_S, seconds)] += 1
        self.sum_s += seconds


class Tallies:
    """Counts of ended jobs for the metrics of this process, updated at each scrape from the jobs that ended since."""

    def __init__(self, store: TallyStore) -> None:
        self.store = store
        self.stations = 0
        self.recorded_bytes = 0
        self._recorded_at_s: float | None = None
        self._adding: Future[int] | None = None
        self._lock = Lock()
        self._begin_anew()

    def _begin_anew(self) -> None:
        """Start with nothing counted."""
        self.finished: Counter[tuple[str, str, str]] = Counter()
        """(procedure, state, verdict) -> number of jobs."""
        self.durations: dict[str, Spread] = {}
        """Procedure -> durations from start to end."""
        self.waits = Spread()
        """Durations from submission to start."""
        self._ended_stations = 0
        """Number of stations of all jobs that ended, by their last end."""
        self._may_resume: dict[str, int] = {}
        """Those of each job that may be resumed from its end."""
        self._recent: dict[tuple[str, datetime], None] = {}
        self._newest: datetime | None = None

    def update(self) -> None:
        """Count the jobs that ended since the last call. Raises `StorageFailure`."""
        with self._lock:
            at = now()
            if self._newest is not None and at < self._newest - OVERLAP:
                self._begin_anew()  # the clock was set back: jobs that end now seem to end before those counted
            since, after = None if self._newest is None else self._newest - OVERLAP, ""
            while page := self.store.endings(since, after, PAGE):
                for ending in page:
                    self._count(ending)
                since, after = page[-1].finished_at, page[-1].id
            if self._newest is not None:
                self._newest = min(self._newest, at)
                self._recent = {k: None for k in self._recent if k[1] >= self._newest - OVERLAP}
            self.stations = self._all_stations()
            self._add_up_recordings()

    def _all_stations(self) -> int:
        """Number of stations done by all jobs; those of a resumed job are open again, and end no earlier."""
        still = self.store.stations_of_open_jobs()
        resumed = sum(self._may_resume.get(job, 0) for job in still)
        return self._ended_stations - resumed + sum(still.values())

    def ended(self) -> dict[JobState, int]:
        """Return the number of jobs in each state that is never left, from the tally: a count in the database takes
        longer as the history grows.
        """
        found = Counter[str]()
        for (_, state, _), count in self.finished.items():
            found[state] += count
        return {state: found[state.value] for state in NEVER_LEFT}

    def _add_up_recordings(self) -> None:
        """Make the sum over all recordings: the first one here, later ones in a thread of their own.

        An error of the thread is raised by the scrape after it.
        """
        if self._recorded_at_s is None:
            self.recorded_bytes = self.store.recorded_bytes()
            self._recorded_at_s = monotonic_s()
        if self._adding is not None and self._adding.done():
            adding, self._adding = self._adding, None
            self.recorded_bytes = adding.result()
        if self._adding is None and monotonic_s() - self._recorded_at_s > RECORDINGS_S:
            self._adding = in_background("sum of recordings", self.store.recorded_bytes)
            self._recorded_at_s = monotonic_s()

    def _count(self, ending: Ending) -> None:
        key = (ending.id, ending.finished_at)
        if key in self._recent:
            return
        self._recent[key] = None
        self._newest = ending.finished_at if self._newest is None else max(self._newest, ending.finished_at)
        self.finished[ending.procedure, ending.state, ending.verdict or ""] += 1
        self._ended_stations += ending.stations_done - self._may_resume.pop(ending.id, 0)
        if ending.stations_done and JobState(ending.state) not in NEVER_LEFT:
            self._may_resume[ending.id] = ending.stations_done
        if ending.started_at is not None:
            duration_s = (ending.finished_at - ending.started_at).total_seconds()
            self.durations.setdefault(ending.procedure, Spread()).add(max(0.0, duration_s))
            self.waits.add(max(0.0, (ending.started_at - ending.created_at).total_seconds()))
