"""The audit trail in SQL: rows are only added, each chained to the one before."""

import json
from collections.abc import Iterator
from datetime import datetime

from sqlalchemy import ColumnElement, String, cast, delete, func, or_, select
from sqlalchemy.orm import Session

from bench_service.mapping import copied
from bench_service.model.errors import IllegalTransition
from bench_service.model.records import Page
from bench_service.persistence.database import Database
from bench_service.persistence.paging import page
from bench_service.persistence.tables.telemetry import AuditCheckpointRow, AuditRow
from bench_service.telemetry.audit import AuditEntry
from bench_service.telemetry.audit_chain import BEGINNING, ChainCheck, ChainReport, Checkpoint, Link

CHAIN = "audit chain"
AT_ONCE = 2000
"""Number of entries that are read at one time."""
STRETCH = 20_000
"""Maximum number of entries that are removed in one transaction."""


class SqlAuditTrail:
    """SQL implementation of `bench_service.telemetry.audit.AuditTrail`: rows are only added."""

    def __init__(self, database: Database) -> None:
        self._database = database

    def add(self, entry: AuditEntry) -> None:
        with self._database.write() as session:
            self._database.one_at_a_time(session, CHAIN)
            _add(session, entry)

    def add_once(self, entry: AuditEntry) -> bool:
        with self._database.write() as session:
            self._database.one_at_a_time(session, CHAIN)
            known = session.get(AuditRow, entry.id) is not None
            if not known:
                _add(session, entry)
            return not known

    def list(
        self, *, who: str | None = None, target: str | None = None, after: str | None = None, limit: int = 50
    ) -> Page[AuditEntry]:
        query = select(AuditRow)
        if who is not None:
            query = query.where(AuditRow.who == who)
        if target is not None:
            part = f"/{target}"
            query = query.where(
                or_(
                    AuditRow.target == target,
                    AuditRow.target.endswith(part, autoescape=True),
                    AuditRow.target.contains(f"{part}/", autoescape=True),
                )
            )
        with self._database.read() as session:
            return page(session, query, AuditRow.id, after, limit, _entry)

    def verify(self, expected: str | None = None) -> ChainReport:
        check = ChainCheck(expected=expected)
        with self._database.read() as session:
            check.pass_checkpoints(_checkpoints(session))
            for link in _links(session, check.sequence):
                check.pass_link(link)
            check.strangers(session.scalar(select(func.count()).where(_outside(check))) or 0)
        return check.report()

    def close(self, before: datetime, by: str, at: datetime) -> tuple[Checkpoint, ...]:
        made: list[Checkpoint] = []
        while (one := self._close_stretch(before, by, at)) is not None:
            made.append(one)
        return tuple(made)

    def _close_stretch(self, before: datetime, by: str, at: datetime) -> Checkpoint | None:
        """Close the oldest stretch of entries before a moment; None where there is none."""
        with self._database.write() as session:
            self._database.one_at_a_time(session, CHAIN)
            check = ChainCheck()
            check.pass_checkpoints(_checkpoints(session))
            first, start, stretch = check.sequence + 1, check.digest, list[Link]()
            for link in _links(session, check.sequence):
                if link.at >= before or len(stretch) == STRETCH:
                    break
                check.pass_link(link)
                stretch.append(link)
            if check.faults:
                raise IllegalTransition(f"the audit chain is broken, nothing is removed: {check.faults[0]}")
            if not stretch:
                return None
            times = min(link.at for link in stretch), max(link.at for link in stretch)
            made = Checkpoint(first, check.sequence, *times, start, check.digest, at, by)
            session.add(copied(AuditCheckpointRow, made))
            session.execute(delete(AuditRow).where(AuditRow.sequence <= made.last))
            return made


def _add(session: Session, entry: AuditEntry) -> None:
    sequence, before = _head(session)
    stored = json.dumps(entry.detail, allow_nan=False)  # as the engine writes it
    link = copied(Link, entry, sequence=sequence + 1, detail=stored)
    session.add(copied(AuditRow, entry, sequence=link.sequence, digest=link.digest_after(before)))


def _head(session: Session) -> tuple[int, str]:
    """Sequence and digest of the newest entry, or of the last checkpoint."""
    entry = select(AuditRow.sequence, AuditRow.digest).where(AuditRow.sequence.is_not(None))
    row = session.execute(entry.order_by(AuditRow.sequence.desc()).limit(1)).first()
    if row is None:
        closed = select(AuditCheckpointRow.last, AuditCheckpointRow.digest)
        row = session.execute(closed.order_by(AuditCheckpointRow.last.desc()).limit(1)).first()
    return (0, BEGINNING) if row is None else (row[0], row[1])


def _checkpoints(session: Session) -> tuple[Checkpoint, ...]:
    rows = session.scalars(select(AuditCheckpointRow).order_by(AuditCheckpointRow.last))
    return tuple(copied(Checkpoint, row) for row in rows)


def _links(session: Session, after: int) -> Iterator[Link]:
    """Every entry of the chain after a sequence, in order, as it is stored."""
    fields = (AuditRow.sequence, AuditRow.id, AuditRow.at, AuditRow.who, AuditRow.action, AuditRow.target)
    query = select(*fields, AuditRow.outcome, cast(AuditRow.detail, String).label("detail"), AuditRow.digest)
    while True:
        rows = session.execute(query.where(AuditRow.sequence > after).order_by(AuditRow.sequence).limit(AT_ONCE)).all()
        for row in rows:
            yield Link(*row)
        if not rows:
            return
        after = rows[-1].sequence


def _outside(check: ChainCheck) -> ColumnElement[bool]:
    """Condition of entries that no walk along the chain meets."""
    closed = check.checkpoints[-1].last if check.checkpoints else 0
    return or_(AuditRow.sequence.is_(None), AuditRow.sequence <= closed)


def _entry(row: AuditRow) -> AuditEntry:
    return copied(AuditEntry, row)
