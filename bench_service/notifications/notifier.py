"""Watches one bench and its jobs, and puts messages about them into the outboxes; lives in a thread of its own.

The process that drives a bench notifies for it, so each event is reported once. It reports what happens while it runs,
and the stops in force.
"""

import logging
from collections import deque
from collections.abc import Callable
from threading import Event as Flag
from threading import Thread

from bench_service.bench.directory import certificates_due
from bench_service.bench.processes import Watch
from bench_service.campaigns.stores import Stores
from bench_service.model.errors import ServiceError
from bench_service.notifications.messages import (
    Message,
    of_certificate,
    of_disk,
    of_event,
    of_run,
    of_silent_supervisor,
    of_stop,
)
from bench_service.notifications.outbox import Outbox
from bench_service.wall_clock import monotonic_s, now

LOOK_S = 1.0
"""Interval between two looks at stops and campaign runs, and longest time until a message is tried [s]."""
DISK_S = 60.0
RUNS = 20
"""Number of latest campaign runs that are looked at."""

log = logging.getLogger(__name__)


class Notifier:
    """Thread that watches one bench, its jobs and campaign runs, makes messages of what happens, and has each target's
    outbox deliver them.
    """

    def __init__(
        self,
        bench: str,
        stores: Stores,
        outboxes: list[Outbox],
        free_bytes: Callable[[], int | None],
        least_free_bytes: int,
        watch: Watch,
    ) -> None:
        self._bench = bench
        self._stores = stores
        self._outboxes = outboxes
        self._free_bytes = free_bytes
        self._least_free_bytes = least_free_bytes
        self._watch = watch
        self._began = now()
        self._changed: deque[str] = deque(maxlen=10_000)
        self._known: dict[str, int] = {}
        self._told: set[str] = set()
        self._disk_at_s = float("-inf")
        self._ending = Flag()
        self._woken = Flag()
        self._thread = Thread(target=self._run, name="notifier", daemon=True)
        stores.jobs.on_event(self._hear)

    def begin(self) -> None:
        """Start the thread that delivers messages."""
        self._thread.start()

    def end(self) -> None:
        """Stop the thread and wait for it, at most 15 s; undelivered messages stay in their files for the next
        process.
        """
        self._ending.set()
        self._woken.set()
        self._thread.join(15.0)

    def _hear(self, job_id: str) -> None:
        self._changed.append(job_id)
        self._woken.set()

    def _run(self) -> None:
        while not self._ending.is_set():
            self._woken.wait(LOOK_S)
            self._woken.clear()
            try:
                self._look()
            except (ServiceError, OSError) as error:
                log.warning("the notifier cannot look now: %s", error)
            for outbox in self._outboxes:
                try:
                    outbox.send(now())
                except (ServiceError, OSError) as error:
                    log.warning("messages to %s wait: %s", outbox.target.name, error)

    def _look(self) -> None:
        silent = self._watch.silent_supervisor()  # first: it needs no database, which may be away
        if silent is not None:
            self._tell(of_silent_supervisor(self._bench, str(silent), now()))
        while self._changed:
            self._jobs_news(self._changed[0])
            self._changed.popleft()  # after it was read: a database that is away loses nothing
        for stop in self._stores.benches.standing_stops(self._bench):
            self._tell(of_stop(stop))
        for run in self._stores.campaigns.runs(limit=RUNS).items:
            if run.bench == self._bench and (run.finished_at or self._began) > self._began:
                self._tell(of_run(run, now()))
        if monotonic_s() - self._disk_at_s >= DISK_S:
            self._disk_at_s = monotonic_s()
            free = self._free_bytes()
            if free is not None and free < self._least_free_bytes:
                self._tell(of_disk(self._bench, free, now()))
            self._look_at_certificates()

    def _look_at_certificates(self) -> None:
        """Report certificates of the bench's devices that have expired, and those that expire within a month."""
        for sentence in certificates_due(self._stores.benches.bench(self._bench), now()):
            self._tell(of_certificate(self._bench, sentence, now()))

    def _jobs_news(self, job_id: str) -> None:
        job = self._stores.jobs.get(job_id)
        if job.bench != self._bench:
            return
        for event in self._stores.jobs.events(job_id, self._known.get(job_id, 0)):
            self._known[job_id] = event.sequence
            if event.at >= self._began:
                self._tell(of_event(job, event))
        if len(self._known) > 1000:
            self._known.pop(next(iter(self._known)))

    def _tell(self, message: Message | None) -> None:
        if message is None or message.key in self._told:
            return
        self._told.add(message.key)
        for outbox in self._outboxes:
            outbox.put(message)
