"""Upkeep of the database for clients and for the night: its size, the check of everything stored, and its reports."""

import logging
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from datetime import datetime, timedelta
from threading import Event, Thread
from typing import Any

from bench_service.evidence.stores import EvidenceStores
from bench_service.model.errors import ServiceError
from bench_service.model.raw_data import HERE
from bench_service.telemetry.upkeep import DatabasePort, DatabaseSize, UpkeepKind, UpkeepReport
from bench_service.wall_clock import monotonic_s, new_id, now

LISTED = 200
"""Damaged chunks that a report lists."""
APART = timedelta(hours=6)
"""Shortest time between the beginnings of two nightly checks of one database, by whichever process."""
LOOK_S = 30.0
"""Interval at which the clock is read again [s], because somebody may set it."""
REST = 1.0
"""Rest after each recording at night, in units of the time that its check took."""

log = logging.getLogger(__name__)


@dataclass
class _Found:
    faults: tuple[str, ...] = ()
    recordings: int = 0
    stored_bytes: int = 0
    damaged_chunks: int = 0
    elsewhere: int = 0
    """Recordings whose raw data are archived or removed."""
    damaged: list[dict[str, Any]] = field(default_factory=list[dict[str, Any]])


class UpkeepService:
    """Size and check of one database, and the reports of checks, for clients and for the night."""

    def __init__(self, stores: EvidenceStores, database: DatabasePort, by: str) -> None:
        """Set up with `by`, the name of this process in reports."""
        self._stores = stores
        self._database = database
        self._by = by

    def size(self) -> DatabaseSize:
        """Return the size of the database [bytes], and its revision. Raises `StorageFailure`."""
        return self._database.size()

    def scrub(
        self, rest: Callable[[float], bool] = lambda took_s: False, unless_since: datetime | None = None
    ) -> UpkeepReport | None:
        """Check the database's integrity and every stored chunk against its hash; store the report and return it.

        `rest(took_s)`: called after each recording; True ends the check without a result. `unless_since`: None is
        returned where another check began since then. Raises `StorageFailure`.
        """
        report = UpkeepReport(new_id(), UpkeepKind.SCRUB, now(), self._by)
        if not self._stores.upkeep.begin(report, unless_since):
            return None
        begun_s = monotonic_s()
        found = _Found(self._database.faults())
        if not self._recordings(found, rest):
            return None
        good = not found.faults and not found.damaged_chunks
        document = {**vars(found), "faults": list(found.faults), "took_s": round(monotonic_s() - begun_s, 3)}
        ended = replace(report, ended_at=now(), good=good, document=document)
        self._stores.upkeep.end(ended)
        said = log.info if good else log.error
        said("the database was checked: %s", sentence(ended))
        return ended

    def _recordings(self, found: _Found, rest: Callable[[float], bool]) -> bool:
        """Check every recording, newest first; False where `rest` ended it."""
        after: str | None = None
        while True:
            page = self._stores.recordings.list(after=after, limit=100)
            for recording in page.items:
                if recording.raw not in HERE:  # its bytes are not in the database: reading an archive back checks them
                    found.elsewhere += 1
                    continue
                begun_s = monotonic_s()
                self._check(recording.info.id, recording.info.count, found)
                found.recordings += 1
                found.stored_bytes += recording.stored_bytes
                if rest(monotonic_s() - begun_s):
                    return False
            after = page.next
            if after is None:
                return True

    def _check(self, recording_id: str, count: int, found: _Found) -> None:
        for chunk in self._stores.recordings.damage(recording_id, 0, count):
            found.damaged_chunks += 1
            if len(found.damaged) < LISTED:
                found.damaged.append({"recording": recording_id, **vars(chunk)})

    def troubles(self) -> tuple[str, ...]:
        """Return the reasons why nothing may be stored now, a sentence each: the file was exchanged, or the last check
        found it damaged.
        """
        trouble = self._database.trouble()
        last = self._stores.upkeep.last(UpkeepKind.SCRUB) if trouble is None else None
        if last is None or not last.document.get("faults"):
            return () if trouble is None else (trouble,)
        return (f"the database is damaged ({sentence(last)}): restore a copy, `bench restore`",)

    def notes(self) -> tuple[str, ...]:
        """Return sentences about the last check where it found recordings damaged; empty where it did not."""
        last = self._stores.upkeep.last(UpkeepKind.SCRUB)
        if last is None or last.good or last.document.get("faults"):
            return ()
        return (f"the last check of the database found damage: {sentence(last)}",)


def sentence(report: UpkeepReport) -> str:
    """Return the outcome of a check of the database as one sentence."""
    document, at = report.document, report.began_at.isoformat(timespec="seconds")
    if report.good:
        return f"{document['recordings']} recordings, {document['stored_bytes']} bytes are as they were stored ({at})"
    named = [f"chunk {each['number']} of recording {each['recording']}" for each in document["damaged"][:3]]
    more = document["damaged_chunks"] - len(named)
    parts = [*document["faults"][:3], *named, *([f"{more} more chunks"] if more > 0 else [])]
    return f"{'; '.join(parts)} ({at})"


class NightlyScrub:
    """Thread that checks the database each night at a set time, then does the other work of the night. It rests after
    each recording for as long as its check took, so that other work is not held up.
    """

    def __init__(self, upkeep: UpkeepService, at: str, then: Callable[[Event], object] = lambda ending: None) -> None:
        """Set up with `at`, the time of day on this host's clock, "HH:MM"; empty: never.

        `then`: other work of the night, called after the check with the event that ends it.
        """
        self._upkeep = upkeep
        self._then = then
        self._at = at
        self._ending = Event()
        self._thread = Thread(target=self._run, name="nightly check", daemon=True)

    def begin(self) -> None:
        """Start the thread that waits for the night, where the settings name a time."""
        if self._at:
            self._thread.start()

    def end(self) -> None:
        """Ask the thread to end, without waiting; a check under way ends without a result after its present
        recording.
        """
        self._ending.set()

    def _run(self) -> None:
        due = next_time(self._at, now())
        while not self._ending.wait(LOOK_S):
            at = now()
            if due - at > timedelta(days=1):  # the clock was set back
                due = next_time(self._at, at)
            if at < due:
                continue
            due = next_time(self._at, at)
            try:
                self._upkeep.scrub(lambda took_s: self._ending.wait(REST * took_s), at - APART)
                self._then(self._ending)
            except ServiceError as error:
                log.warning("the nightly maintenance failed: %s", error)
            except Exception:
                log.exception("the nightly maintenance failed unexpectedly")


def next_time(at: str, moment: datetime) -> datetime:
    """Return the next moment after `moment` at which this host's clock shows `at`, "HH:MM"."""
    hour, minute = map(int, at.split(":"))
    local = moment.astimezone().replace(hour=hour, minute=minute, second=0, microsecond=0)
    while local <= moment:
        local += timedelta(days=1)
    return local
