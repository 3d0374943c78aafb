"""The places of raw data in SQL: which recordings are old enough, what needs them, and the moves of their chunks.

A move begins with one transaction that decides (`removing`, `archiving`, `restoring`), goes over the chunks a few at a
time, so that it keeps no writer waiting, and ends with one that says so. A crash in between leaves the first word, by
which every reader acts rightly, and the next run continues from there.
"""

from collections.abc import Iterator, Mapping, Sequence
from datetime import datetime

from sqlalchemy import case, func, select, update
from sqlalchemy.orm import Session

from bench_service.mapping import copied
from bench_service.model.errors import IllegalTransition, NotFound
from bench_service.model.job import FINAL
from bench_service.model.raw_data import Candidate, Growth, Hold, RawRule, RawState, Share
from bench_service.model.records import RecordingState
from bench_service.model.request import CAMPAIGN_RUN
from bench_service.persistence.archive.chunks import archived_chunk
from bench_service.persistence.archive.dataset import ParquetArchive
from bench_service.persistence.database import Database
from bench_service.persistence.evidence.raw_places import require_raw
from bench_service.persistence.evidence.raw_wants import wanted_by_analyses, wanted_by_calibrations, wanted_by_holds
from bench_service.persistence.searching import first_id
from bench_service.persistence.tables.campaigns import CampaignRunRow
from bench_service.persistence.tables.evidence import ChunkRow, HoldRow, RecordingRow
from bench_service.persistence.tables.jobs import JobRow
from procedures.core.limits import Verdict

PAGE = 500
CHUNKS = 16
"""Chunks that one transaction empties or fills."""
_COMPLETE = RecordingState.COMPLETE.value
_STORED = RawState.STORED.value
_PASS = Verdict.PASS.value
_BEGUN = tuple(state.value for state in (RawState.ARCHIVING, RawState.REMOVING, RawState.RESTORING))


class SqlRawDataStore:
    """SQL implementation of `bench_service.evidence.raw_data.store.RawDataStore`."""

    def __init__(self, database: Database) -> None:
        self._database = database

    def candidates(self, rule: RawRule, before: datetime) -> Iterator[Candidate]:
        query = (
            select(RecordingRow.id, RecordingRow.job_id, RecordingRow.stored_bytes, JobRow.labels)
            .outerjoin(JobRow, JobRow.id == RecordingRow.job_id)
            .where(RecordingRow.state == _COMPLETE, RecordingRow.raw == _STORED, RecordingRow.created_at < before)
            .where(func.coalesce(RecordingRow.raw_changed_at, RecordingRow.created_at) < before)
            .where(RecordingRow.id < first_id(before))
            .order_by(RecordingRow.id)
            .limit(PAGE)
        )
        if rule.only_passes:
            query = query.where(JobRow.verdict == _PASS)
        after = ""
        while True:
            with self._database.read() as session:
                rows = session.execute(query.where(RecordingRow.id > after)).all()
            for row in rows:
                run = (row.labels or {}).get(CAMPAIGN_RUN)
                yield Candidate(row.id, row.job_id, row.stored_bytes, run)
            if len(rows) < PAGE:
                return
            after = rows[-1].id

    def of_calibrations(self) -> frozenset[str]:
        with self._database.read() as session:
            return wanted_by_calibrations(session)

    def held(self) -> frozenset[str]:
        with self._database.read() as session:
            return wanted_by_holds(session)

    def of_open_analyses(self) -> frozenset[str]:
        with self._database.read() as session:
            return wanted_by_analyses(session)

    def open_campaign_runs(self) -> frozenset[str]:
        final = [state.value for state in FINAL]
        with self._database.read() as session:
            return frozenset(session.scalars(select(CampaignRunRow.id).where(CampaignRunRow.state.not_in(final))))

    def unfinished(self) -> tuple[tuple[str, RawState], ...]:
        query = select(RecordingRow.id, RecordingRow.raw).where(RecordingRow.raw.in_(_BEGUN))
        with self._database.read() as session:
            return tuple((row.id, RawState(row.raw)) for row in session.execute(query))

    def remove(self, recording_id: str, at: datetime) -> bool:
        with self._database.write() as session:
            row = _locked(session, recording_id)
            if row.raw not in (_STORED, RawState.REMOVING.value):
                return False
            wanted = wanted_by_holds(session, recording_id) | wanted_by_analyses(session, recording_id)
            if row.raw == _STORED and wanted:
                return False
            row.raw, row.raw_changed_at = RawState.REMOVING.value, at
        self._empty(recording_id)
        self._settle(recording_id, RawState.REMOVED, at)
        return True

    def archive(self, recording_id: str, place: str, at: datetime) -> bool:
        with self._database.write() as session:
            row = _locked(session, recording_id)
            if row.raw not in (_STORED, RawState.ARCHIVING.value):
                return False
            if row.raw == _STORED:
                row.raw, row.raw_changed_at, row.archive = RawState.ARCHIVING.value, at, place
        self._empty(recording_id)
        self._settle(recording_id, RawState.ARCHIVED, at)
        return True

    def restore(self, recording_id: str, at: datetime) -> bool:
        with self._database.write() as session:
            row = _locked(session, recording_id)
            require_raw(row)
            if row.raw == _STORED or row.archive is None:
                return False
            row.raw, place = RawState.RESTORING.value, row.archive
        query = select(ChunkRow.number, ChunkRow.sha256).where(ChunkRow.recording_id == recording_id)
        empty = query.where(func.length(ChunkRow.payload) == 0).order_by(ChunkRow.number).limit(CHUNKS)
        while True:
            with self._database.read() as session:
                missing = session.execute(empty).all()
            if not missing:
                break
            found = [(number, archived_chunk(place, recording_id, number, sha256)) for number, sha256 in missing]
            with self._database.write() as session:
                for number, payload in found:
                    _put(session, recording_id, [number], payload)
        self._settle(recording_id, RawState.STORED, at)
        return True

    def add_hold(self, hold: Hold) -> Hold:
        with self._database.write() as session:
            require_raw(_locked(session, hold.recording))
            session.add(copied(HoldRow, hold, recording_id=hold.recording))
        return hold

    def release_hold(self, hold_id: str, by: str, at: datetime) -> Hold:
        with self._database.write() as session:
            row = session.scalar(select(HoldRow).where(HoldRow.id == hold_id).with_for_update())
            if row is None:
                raise NotFound("hold", hold_id)
            if row.released_at is not None:
                raise IllegalTransition(f"hold {hold_id} was released by {row.released_by}")
            row.released_at, row.released_by = at, by
            return copied(Hold, row, recording=row.recording_id)

    def holds(self, recording_id: str | None = None) -> tuple[Hold, ...]:
        query = select(HoldRow).where(HoldRow.released_at.is_(None)).order_by(HoldRow.id.desc())
        if recording_id is not None:
            query = query.where(HoldRow.recording_id == recording_id)
        with self._database.read() as session:
            return tuple(copied(Hold, row, recording=row.recording_id) for row in session.scalars(query))

    def archive_at(self, address: str) -> ParquetArchive:
        return ParquetArchive(self._database, address)

    def shares(self) -> Mapping[RawState, Share]:
        query = select(RecordingRow.raw, func.count(), func.sum(RecordingRow.stored_bytes)).group_by(RecordingRow.raw)
        with self._database.read() as session:
            return {RawState(raw): Share(number, int(total or 0)) for raw, number, total in session.execute(query)}

    def growth(self, since: datetime, at: datetime) -> Growth:
        made = select(func.sum(RecordingRow.stored_bytes), func.min(RecordingRow.created_at)).where(
            RecordingRow.id >= first_id(since), RecordingRow.created_at >= since
        )
        passes = made.join(JobRow, JobRow.id == RecordingRow.job_id).where(JobRow.verdict == _PASS)
        with self._database.read() as session:
            total, first = session.execute(made).one()
            of_passes = session.execute(passes).one()[0]
        days = max(1.0, (at - (first or at)).total_seconds() / 86400.0)
        return Growth(days, int(total or 0), int(of_passes or 0))

    def passes_bytes_before(self, moments: Sequence[datetime]) -> tuple[int, ...]:
        sums = (func.sum(case((RecordingRow.created_at < at, RecordingRow.stored_bytes), else_=0)) for at in moments)
        query = (
            select(*sums)
            .join(JobRow, JobRow.id == RecordingRow.job_id)
            .where(RecordingRow.raw == _STORED, JobRow.verdict == _PASS)
        )
        with self._database.read() as session:
            return tuple(int(total or 0) for total in session.execute(query).one())

    def _empty(self, recording_id: str) -> None:
        """Empty the chunks of a recording, a few at a time."""
        query = select(ChunkRow.number).where(ChunkRow.recording_id == recording_id)
        full = query.where(func.length(ChunkRow.payload) > 0).order_by(ChunkRow.number).limit(CHUNKS)
        while True:
            with self._database.read() as session:
                numbers = session.scalars(full).all()
            if not numbers:
                return
            with self._database.write() as session:
                _put(session, recording_id, numbers, b"")

    def _settle(self, recording_id: str, state: RawState, at: datetime) -> None:
        values = {"raw": state.value, "raw_changed_at": at}
        with self._database.write() as session:
            session.execute(update(RecordingRow).where(RecordingRow.id == recording_id).values(**values))


def _locked(session: Session, recording_id: str) -> RecordingRow:
    row = session.scalar(select(RecordingRow).where(RecordingRow.id == recording_id).with_for_update())
    if row is None or row.state == RecordingState.OPEN.value:
        raise NotFound("recording", recording_id)
    return row


def _put(session: Session, recording_id: str, numbers: Sequence[int], payload: bytes) -> None:
    mine = (ChunkRow.recording_id == recording_id, ChunkRow.number.in_(numbers))
    session.execute(update(ChunkRow).where(*mine).values(payload=payload))
