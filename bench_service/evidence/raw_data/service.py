"""Raw data over the years: plans, removal and archiving by rule, restoration, holds, and the size of the database."""

import logging
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from datetime import datetime, timedelta

from bench_service.evidence.raw_data.store import Archive
from bench_service.evidence.stores import EvidenceStores
from bench_service.model.errors import DamagedRecording
from bench_service.model.raw_data import (
    Candidate,
    Growth,
    Hold,
    Keeping,
    Prediction,
    RawPlan,
    RawRule,
    RawState,
    Share,
    StorageReport,
)
from bench_service.model.records import StoredRecording
from bench_service.telemetry.upkeep import DatabasePort
from bench_service.wall_clock import new_id, now
from procedures.core.errors import BadParameter

LISTED = 200
"""Recordings and faults that a plan lists."""
GROWTH_DAYS = 30.0
AHEAD_DAYS = (30, 90, 365)
FULL_DAYS = 3650
REFRESH = 100
"""Removals after which the calibrations that count are read again: one may have become current meanwhile."""

log = logging.getLogger(__name__)


@dataclass(frozen=True)
class StorageSettings:
    """The deployment's rules for raw data: days until removal, days until archiving, the archive's address; None: no
    such rule, no archive.
    """

    remove_days: float | None = None
    archive_days: float | None = None
    archive: str | None = None


class RawDataService:
    """Operations on the raw data of one database: removal, archiving, restoration, holds, report of sizes."""

    def __init__(
        self,
        stores: EvidenceStores,
        database: DatabasePort,
        settings: StorageSettings,
        open_archive: Callable[[str], Archive] | None = None,
    ) -> None:
        """Set up with `open_archive`: opens the archive at an address; None: there is none here."""
        self._stores = stores
        self._database = database
        self.settings = settings
        self._open_archive = open_archive

    def remove(self, days: float | None, dry_run: bool, go_on: Callable[[], bool] = lambda: True) -> RawPlan:
        """Remove the raw data of routine passes after `days` (None: as the settings say), or only plan it (`dry_run`).

        Raises `BadParameter` where neither says how many days.
        """
        days = self.settings.remove_days if days is None else days
        if days is None:
            raise BadParameter("days", None, "a number of days, or the rule BENCH_RAW_DAYS of the service")
        plan = self._plan(RawRule(days, only_passes=True), dry_run, self._stores.raw_data.remove, go_on)
        if not dry_run:
            self._go_on(RawState.REMOVING)
        return plan

    def archive(self, days: float | None, dry_run: bool, go_on: Callable[[], bool] = lambda: True) -> RawPlan:
        """Move the raw data of complete recordings to the archive after `days`, or only plan it (`dry_run`).

        Raises `BadParameter` without an archive or days, `ArchiveAway` where it cannot be written at all.
        """
        days = self.settings.archive_days if days is None else days
        if days is None:
            raise BadParameter("days", None, "a number of days, or the rule BENCH_ARCHIVE_DAYS of the service")
        rule = RawRule(days, only_passes=False)
        if dry_run:
            return self._plan(rule, dry_run, lambda recording, at: True, go_on)
        archive = self._archive()
        self._go_on(RawState.ARCHIVING)

        def move(recording: str, at: datetime) -> bool:
            archive.copy(recording)
            return self._stores.raw_data.archive(recording, archive.place, at)

        plan = self._plan(rule, dry_run, move, go_on)
        archive.write_tables()
        return plan

    def restore(self, recording_id: str) -> StoredRecording:
        """Bring a recording's raw data back into the database.

        Raises `NotFound`, `RawDataRemoved`, `ArchiveAway`, `DamagedRecording`.
        """
        self._stores.recordings.get(recording_id)
        self._stores.raw_data.restore(recording_id, now())
        return self._stores.recordings.get(recording_id)

    def hold(self, recording_id: str, reason: str, by: str) -> Hold:
        """Store a hold on a recording's raw data, so that no rule removes them, and return it. Raises `NotFound`,
        `RawDataRemoved`.
        """
        return self._stores.raw_data.add_hold(Hold(new_id(), recording_id, reason, by, now()))

    def release(self, hold_id: str, by: str) -> Hold:
        """Release a hold and return it. Raises `NotFound`, `IllegalTransition` for one that was released."""
        return self._stores.raw_data.release_hold(hold_id, by, now())

    def report(self) -> StorageReport:
        """Return the size of the database and of its parts, its growth, and a prediction of when the disk is full."""
        size, at, rules = self._database.size(), now(), self.settings
        growth = self._stores.raw_data.growth(at - timedelta(days=GROWTH_DAYS), at)
        shares = self._stores.raw_data.shares()
        used = size.stored_bytes + (size.log_bytes or 0)
        leaving = self._leaving(growth, shares, at)
        per_day = growth.stored_bytes / growth.days
        predicted = tuple(
            Prediction(days, used + round(per_day * days), max(0, used + round(per_day * days - out)))
            for days, out in zip(AHEAD_DAYS, leaving, strict=True)
        )
        return StorageReport(
            stored_bytes=size.stored_bytes,
            reusable_bytes=size.reusable_bytes,
            free_bytes=size.free_bytes,
            raw=shares,
            growth=growth,
            predicted=predicted,
            full_at=None if size.free_bytes is None else _full_at(used, size.free_bytes, predicted, at),
            remove_days=rules.remove_days,
            archive_days=rules.archive_days,
            archive=rules.archive,
        )

    def _leaving(self, growth: Growth, shares: Mapping[RawState, Share], at: datetime) -> list[float]:
        """Bytes that the rules take out of the database within each of `AHEAD_DAYS`.

        With an archive only the growth of its last days stays. Without, routine passes go when they are of age: those
        that are here by their dates, those to come at their share of the growth.
        """
        rules, per_day = self.settings, growth.stored_bytes / growth.days
        if rules.archive_days is not None and rules.archive is not None:
            here = shares[RawState.STORED].stored_bytes if RawState.STORED in shares else 0
            return [max(0.0, here + per_day * (days - rules.archive_days)) for days in AHEAD_DAYS]
        if rules.remove_days is None:
            return [0.0 for _ in AHEAD_DAYS]
        passes = growth.passes_bytes / growth.days
        moments = [min(at, at + timedelta(days=days - rules.remove_days)) for days in AHEAD_DAYS]
        of_age = self._stores.raw_data.passes_bytes_before(moments)
        coming = [passes * max(0.0, days - rules.remove_days) for days in AHEAD_DAYS]
        return [now_here + later for now_here, later in zip(of_age, coming, strict=True)]

    def _plan(
        self,
        rule: RawRule,
        dry_run: bool,
        move: Callable[[str, datetime], bool],
        go_on: Callable[[], bool],
    ) -> RawPlan:
        at = now()
        plan = RawPlan(rule, at - timedelta(days=rule.days))
        keeps, moved = _Keeps(self._stores), 0
        for candidate in self._stores.raw_data.candidates(rule, plan.before):
            if not go_on():
                break
            reason = keeps.reason(candidate) if rule.only_passes else None
            if reason is not None:
                plan.kept[reason] = plan.kept.get(reason, 0) + 1
                continue
            plan.stored_bytes += candidate.stored_bytes
            if len(plan.recordings) < LISTED:
                plan.recordings.append(candidate.id)
            if dry_run:
                continue
            self._move(plan, candidate, move)
            moved += 1
            if moved % REFRESH == 0:
                keeps = _Keeps(self._stores)
        return plan

    def _move(self, plan: RawPlan, candidate: Candidate, move: Callable[[str, datetime], bool]) -> None:
        try:
            if move(candidate.id, now()):
                plan.done += 1
                plan.done_bytes += candidate.stored_bytes
        except DamagedRecording as error:  # it stays where it is; the nightly check names it too
            log.error("raw data stay in the database: %s", error)
            if len(plan.faults) < LISTED:
                plan.faults.append(str(error))

    def _go_on(self, state: RawState) -> None:
        """End the moves that a crash left half done."""
        raw = self._stores.raw_data
        for recording, left in raw.unfinished():
            if left is not state:
                continue
            if left is RawState.REMOVING:
                raw.remove(recording, now())
            elif (place := self._stores.recordings.get(recording).archive) is not None:
                raw.archive(recording, place, now())

    def _archive(self) -> Archive:
        if self.settings.archive is None or self._open_archive is None:
            raise BadParameter(
                "archive", None, "an archive: set BENCH_ARCHIVE of the service to a folder or s3://bucket/prefix"
            )
        return self._open_archive(self.settings.archive)


class _Keeps:
    """Reasons that keep raw data, read once for many recordings."""

    def __init__(self, stores: EvidenceStores) -> None:
        raw = stores.raw_data
        self._sets = (
            (Keeping.CALIBRATION, raw.of_calibrations()),
            (Keeping.HOLD, raw.held()),
            (Keeping.ANALYSIS, raw.of_open_analyses()),
        )
        self._runs = raw.open_campaign_runs()

    def reason(self, candidate: Candidate) -> Keeping | None:
        """The first reason that keeps a recording; None: there is none."""
        for reason, recordings in self._sets:
            if candidate.id in recordings:
                return reason
        return Keeping.CAMPAIGN if candidate.campaign_run in self._runs else None


def _full_at(used: int, free: int, predicted: Sequence[Prediction], at: datetime) -> datetime | None:
    """The day on which the disk is full, along straight lines between the predictions; None: beyond ten years."""
    last_days, last = 0, used
    rate = 0.0
    for one in predicted:
        rate = (one.with_rules_bytes - last) / (one.days - last_days)
        if one.with_rules_bytes - used >= free:
            return at + timedelta(days=last_days + (used + free - last) / rate)
        last_days, last = one.days, one.with_rules_bytes
    days = last_days + (used + free - last) / rate if rate > 0 else FULL_DAYS
    return at + timedelta(days=days) if days < FULL_DAYS else None
