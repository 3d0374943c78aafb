"""Leases of manual mode in SQL. A lease that begins on a bench and a job that is claimed there take turns."""

from dataclasses import asdict
from datetime import datetime

from sqlalchemy import func, select, update
from sqlalchemy.orm import Session

from bench_service.jobs.manual.store import LeaseNews
from bench_service.jobs.reservation import Reserved
from bench_service.mapping import copied
from bench_service.model.errors import AlreadyReserved, IdempotencyConflict, ManualRefused, NotFound
from bench_service.model.job import JobState
from bench_service.model.manual import Answer, DemandState, ManualDemand, ManualLease
from bench_service.model.records import Idempotency, Page, reasons_of
from bench_service.persistence.bench.registry_store import standing_stops
from bench_service.persistence.database import Database
from bench_service.persistence.idempotency import again_after_conflict, made_before, remember
from bench_service.persistence.jobs.reservation_store import active_reservations
from bench_service.persistence.paging import page
from bench_service.persistence.tables.jobs import JobRow
from bench_service.persistence.tables.manual import ManualDemandRow, ManualLeaseRow

WAITING = 20
"""Largest number of demands of a lease that wait at one time."""
_OPEN_STATES = (DemandState.ACCEPTED.value, DemandState.DOING.value)


class SqlManualStore:
    """SQL implementation of `bench_service.jobs.manual.store.ManualStore`."""

    def __init__(self, database: Database) -> None:
        self._database = database

    def begin(self, lease: ManualLease, idempotency: Idempotency | None = None) -> ManualLease:
        def once() -> ManualLease:
            with self._database.write() as session:
                known = made_before(session, idempotency, "manual lease")
                if known is not None:
                    return lease_of_row(_found(session, known))
                self._database.turn_at_bench(session, lease.bench)
                _require_free(session, lease)
                remember(session, idempotency, "manual lease", lease.id, lease.created_at)
                session.add(copied(ManualLeaseRow, lease))
                return lease

        return again_after_conflict(once)

    def get(self, lease_id: str) -> ManualLease:
        with self._database.read() as session:
            return lease_of_row(_found(session, lease_id))

    def open_on(self, bench: str) -> ManualLease | None:
        with self._database.read() as session:
            return open_lease(session, bench)

    def list(self, *, bench: str | None = None, after: str | None = None, limit: int = 50) -> Page[ManualLease]:
        query = select(ManualLeaseRow)
        if bench is not None:
            query = query.where(ManualLeaseRow.bench == bench)
        with self._database.read() as session:
            return page(session, query, ManualLeaseRow.id, after, limit, lease_of_row)

    def take(self, lease_id: str, at: datetime, process: str) -> ManualLease | None:
        with self._database.write() as session:
            row = _found(session, lease_id)
            self._database.turn_at_bench(session, row.bench)
            running = select(JobRow.id).where(JobRow.bench == row.bench, JobRow.state == JobState.RUNNING.value)
            if row.began_at is not None or not lease_of_row(row).live(at) or session.scalar(running) is not None:
                return None
            row.began_at, row.process = at, process
            return lease_of_row(row)

    def news(self, lease_id: str) -> LeaseNews:
        with self._database.read() as session:
            lease = lease_of_row(_found(session, lease_id))
            rows = session.scalars(
                select(ManualDemandRow)
                .where(ManualDemandRow.lease == lease_id, ManualDemandRow.state == DemandState.ACCEPTED.value)
                .order_by(ManualDemandRow.id)
            )
            demands = tuple(_demand_of_row(row) for row in rows)
            stops = standing_stops(session, lease.bench)
            return LeaseNews(lease, reasons_of(stops) if stops else "", demands)

    def renew(self, lease_id: str, until: datetime, at: datetime) -> ManualLease:
        with self._database.write() as session:
            row = _found(session, lease_id)
            _require_live(lease_of_row(row), at)
            row.until = until
            return lease_of_row(row)

    def ask_end(self, lease_id: str, by: str, at: datetime) -> ManualLease:
        with self._database.write() as session:
            row = _found(session, lease_id)
            if row.ended_at is None and not row.end_asked:
                row.end_asked = by
            if row.ended_at is None and row.began_at is None:
                _end(session, row, at, f"ended by {by} before it began", None)
            return lease_of_row(row)

    def end(self, lease_id: str, at: datetime, because: str, safe: bool | None) -> None:
        with self._database.write() as session:
            _end(session, _found(session, lease_id), at, because, safe)

    def hear(self) -> None:
        with self._database.read() as session:
            if session.scalar(select(ManualLeaseRow.id).where(ManualLeaseRow.ended_at.is_(None)).limit(1)) is None:
                return
        with self._database.write() as session:
            session.execute(
                update(ManualLeaseRow).where(ManualLeaseRow.ended_at.is_(None)).values(heard=ManualLeaseRow.heard + 1)
            )

    def demand(self, demand: ManualDemand, at: datetime) -> ManualDemand:
        def once() -> ManualDemand:
            with self._database.write() as session:
                known = session.scalar(
                    select(ManualDemandRow).where(
                        ManualDemandRow.lease == demand.lease, ManualDemandRow.key == demand.key
                    )
                )
                if known is not None:
                    made = _demand_of_row(known)
                    if (made.kind, made.values) != (demand.kind, demand.values):
                        raise IdempotencyConflict(f"the key {demand.key!r} was used before with another demand")
                    return made
                lease = lease_of_row(_found(session, demand.lease))
                _require_live(lease, at)
                _require_not_stopped(session, lease.bench)
                waiting = select(func.count()).where(
                    ManualDemandRow.lease == demand.lease, ManualDemandRow.state == DemandState.ACCEPTED.value
                )
                if (session.scalar(waiting) or 0) >= WAITING:
                    raise ManualRefused(f"{WAITING} demands of this lease are waiting already: wait until one is done")
                session.add(_row_of_demand(demand))
                return demand

        return again_after_conflict(once)

    def get_demand(self, lease_id: str, key: str) -> ManualDemand:
        with self._database.read() as session:
            row = session.scalar(
                select(ManualDemandRow).where(ManualDemandRow.lease == lease_id, ManualDemandRow.key == key)
            )
            if row is None:
                raise NotFound("demand", key)
            return _demand_of_row(row)

    def demands(self, lease_id: str, *, after: str | None = None, limit: int = 50) -> Page[ManualDemand]:
        query = select(ManualDemandRow).where(ManualDemandRow.lease == lease_id)
        with self._database.read() as session:
            return page(session, query, ManualDemandRow.id, after, limit, _demand_of_row)

    def answer(self, demand_id: str, state: DemandState, answer: Answer, at: datetime) -> None:
        with self._database.write() as session:
            row = session.get(ManualDemandRow, demand_id)
            if row is None or DemandState(row.state).over:
                return
            row.state, row.answer = state.value, asdict(answer)
            row.ended_at = at if state.over else None


def open_lease(session: Session, bench: str) -> ManualLease | None:
    """Return the lease of a bench that has not ended; None where there is none."""
    row = session.scalar(
        select(ManualLeaseRow).where(ManualLeaseRow.bench == bench, ManualLeaseRow.ended_at.is_(None)).limit(1)
    )
    return None if row is None else lease_of_row(row)


def lease_of_row(row: ManualLeaseRow) -> ManualLease:
    """Convert a row to its lease."""
    return copied(ManualLease, row)


def _require_free(session: Session, lease: ManualLease) -> None:
    """Check that nothing else has the bench. Raises `ManualRefused`, `AlreadyReserved`."""
    other = open_lease(session, lease.bench)
    if other is not None:
        raise ManualRefused(
            f"bench {lease.bench} is in manual mode by {other.holder} until {other.until.isoformat()}, lease {other.id}"
        )
    running = select(JobRow.id).where(JobRow.bench == lease.bench, JobRow.state == JobState.RUNNING.value)
    if (job := session.scalar(running)) is not None:
        raise ManualRefused(f"job {job} drives bench {lease.bench}: cancel it, or wait for its end")
    _require_not_stopped(session, lease.bench)
    active = active_reservations(session, lease.created_at)
    mine = next((r for r in active if r.id == lease.reservation), None)
    for reservation in active:
        name = {Reserved.BENCH: lease.bench, Reserved.UNIT: lease.unit}[reservation.kind]
        if reservation.name == name and not reservation.admits(mine):
            raise AlreadyReserved(
                f"{reservation.kind.value} {name} is reserved by {reservation.holder} until "
                f"{reservation.until.isoformat()}: give that reservation's id, or wait for its end"
            )


def _require_not_stopped(session: Session, bench: str) -> None:
    if stops := standing_stops(session, bench):
        raise ManualRefused(f"bench {bench} is stopped: {reasons_of(stops)}; a person must look at it and release it")


def _require_live(lease: ManualLease, at: datetime) -> None:
    if lease.ended_at is not None:
        raise ManualRefused(f"lease {lease.id} has ended: {lease.ended_because}")
    if lease.end_asked:
        raise ManualRefused(f"lease {lease.id} is being ended by {lease.end_asked}")
    if not lease.live(at):
        raise ManualRefused(f"lease {lease.id} was over at {lease.until.isoformat()}: begin a new one")


def _end(session: Session, row: ManualLeaseRow, at: datetime, because: str, safe: bool | None) -> None:
    if row.ended_at is not None:
        return
    row.ended_at, row.ended_because, row.safe = at, because, safe
    stopped = asdict(Answer(f"the lease ended: {because}"))
    session.execute(
        update(ManualDemandRow)
        .where(ManualDemandRow.lease == row.id, ManualDemandRow.state.in_(_OPEN_STATES))
        .values(state=DemandState.STOPPED.value, answer=stopped, ended_at=at)
    )


def _found(session: Session, lease_id: str) -> ManualLeaseRow:
    row = session.get(ManualLeaseRow, lease_id)
    if row is None:
        raise NotFound("manual lease", lease_id)
    return row


def _demand_of_row(row: ManualDemandRow) -> ManualDemand:
    return copied(ManualDemand, row, state=DemandState(row.state), answer=Answer(**row.answer))


def _row_of_demand(demand: ManualDemand) -> ManualDemandRow:
    return copied(ManualDemandRow, demand, state=demand.state.value, answer=asdict(demand.answer))
