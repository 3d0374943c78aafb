"""Reservations of benches and units in SQL. Of concurrent transactions for one name, one gets it."""

from datetime import datetime
from typing import Any

from sqlalchemy import ColumnElement, bindparam, select
from sqlalchemy.orm import Session

from bench_service.jobs.reservation import Reservation, Reserved
from bench_service.mapping import copied
from bench_service.model.errors import AlreadyReserved, NotFound
from bench_service.model.records import Idempotency, Page
from bench_service.persistence.database import Database
from bench_service.persistence.idempotency import again_after_conflict, made_before, remember
from bench_service.persistence.paging import page
from bench_service.persistence.tables.jobs import ReservationRow


def _holds(at: Any) -> tuple[ColumnElement[bool], ...]:
    """`Reservation.active` in SQL."""
    return ReservationRow.ended_at.is_(None), ReservationRow.until > at


_ACTIVE = select(ReservationRow).where(*_holds(bindparam("at"))).order_by(ReservationRow.id)


class SqlReservationStore:
    """SQL implementation of `bench_service.jobs.reservation.ReservationStore`."""

    def __init__(self, database: Database) -> None:
        self._database = database

    def add(self, reservation: Reservation, idempotency: Idempotency | None = None) -> Reservation:
        def once() -> Reservation:
            with self._database.write() as session:
                known = made_before(session, idempotency, "reservation")
                if known is not None:
                    return reservation_of_row(_found(session, known))
                self._database.one_at_a_time(session, f"reserve {reservation.kind.value} {reservation.name}")
                for other in active_reservations(session, reservation.created_at):
                    if (other.kind, other.name) == (reservation.kind, reservation.name):
                        raise AlreadyReserved(
                            f"{other.kind.value} {other.name!r} is reserved by {other.holder} "
                            f"until {other.until.isoformat()}, reservation {other.id}"
                        )
                remember(session, idempotency, "reservation", reservation.id, reservation.created_at)
                session.add(_row(reservation))
                return reservation

        return again_after_conflict(once)

    def get(self, reservation_id: str) -> Reservation:
        with self._database.read() as session:
            return reservation_of_row(_found(session, reservation_id))

    def list(
        self, *, active_at: datetime | None = None, after: str | None = None, limit: int = 50
    ) -> Page[Reservation]:
        query = select(ReservationRow)
        if active_at is not None:
            query = query.where(*_holds(active_at))
        with self._database.read() as session:
            return page(session, query, ReservationRow.id, after, limit, reservation_of_row)

    def active(self, at: datetime) -> tuple[Reservation, ...]:
        with self._database.read() as session:
            return active_reservations(session, at)

    def end(self, reservation_id: str, at: datetime) -> Reservation:
        with self._database.write() as session:
            row = _found(session, reservation_id)
            if reservation_of_row(row).active(at):
                row.ended_at = at
            return reservation_of_row(row)


def active_reservations(session: Session, at: datetime) -> tuple[Reservation, ...]:
    """Return every reservation that holds at a moment; few do, so all of them are read."""
    found = (reservation_of_row(row) for row in session.scalars(_ACTIVE, {"at": at}))
    return tuple(reservation for reservation in found if reservation.active(at))


def reservation_of_row(row: ReservationRow) -> Reservation:
    """Convert a row to its reservation."""
    return copied(Reservation, row, kind=Reserved(row.kind))


def _row(reservation: Reservation) -> ReservationRow:
    return copied(ReservationRow, reservation, kind=reservation.kind.value)


def _found(session: Session, reservation_id: str) -> ReservationRow:
    row = session.get(ReservationRow, reservation_id)
    if row is None:
        raise NotFound("reservation", reservation_id)
    return row
