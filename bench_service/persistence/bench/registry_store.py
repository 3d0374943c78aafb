"""Benches in SQL, as their workers registered them, and their stops."""

from collections.abc import Iterable, Sequence
from datetime import datetime
from typing import Any

from pydantic import TypeAdapter
from sqlalchemy import func, select, update
from sqlalchemy.orm import Session

from bench_service import wall_clock
from bench_service.model.errors import IllegalTransition, NotFound, TooManyStops
from bench_service.model.records import BenchStop, Page
from bench_service.persistence.database import Database
from bench_service.persistence.idempotency import again_after_conflict
from bench_service.persistence.paging import page
from bench_service.persistence.tables.bench import BenchRow, BenchStopRow
from procedures.bench import BenchDescription

MOST_STANDING = 16
"""Stops of a bench that may stand at a time, as many as its stop channel holds."""
BENCH = TypeAdapter(BenchDescription)
_STANDS = BenchStopRow.released_at.is_(None)
_FIELDS = tuple(column.key for column in BenchStopRow.__table__.columns)
"""Columns of a stop; the fields of `BenchStop` have the same names."""


class SqlBenchRegistry:
    """SQL implementation of `bench_service.bench.registry.BenchRegistry`."""

    def __init__(self, database: Database) -> None:
        self._database = database

    def put_bench(self, bench: BenchDescription, mounted: Sequence[str] = ()) -> None:
        document = {**BENCH.dump_python(bench, mode="json"), "mounted": list(mounted)}

        def once() -> None:
            with self._database.write() as session:
                session.merge(BenchRow(id=bench.id, document=document, updated_at=wall_clock.now()))

        again_after_conflict(once)

    def bench(self, bench_id: str) -> BenchDescription:
        return BENCH.validate_python(self._bench(bench_id))

    def mounted(self, bench_id: str) -> tuple[str, ...]:
        return tuple(self._bench(bench_id).get("mounted", ()))

    def _bench(self, bench_id: str) -> dict[str, Any]:
        with self._database.read() as session:
            row = session.get(BenchRow, bench_id)
        if row is None:
            raise NotFound("bench", bench_id)
        return row.document

    def benches(self) -> tuple[BenchDescription, ...]:
        with self._database.read() as session:
            rows = session.scalars(select(BenchRow).order_by(BenchRow.id)).all()
        return tuple(BENCH.validate_python(row.document) for row in rows)

    def stop_bench(self, stop: BenchStop) -> BenchStop:
        def once() -> BenchStop:
            with self._database.write() as session:
                stored = session.get(BenchStopRow, stop.id)
                if stored is not None:
                    return _stop_of_row(stored)
                self._database.one_at_a_time(session, f"stop bench {stop.bench}")
                standing = select(func.count()).select_from(BenchStopRow).where(BenchStopRow.bench == stop.bench)
                if (session.scalar(standing.where(_STANDS)) or 0) >= MOST_STANDING:
                    raise TooManyStops(
                        f"{MOST_STANDING} stops of bench {stop.bench!r} stand already and keep it from working; this "
                        "one is stored once one of them is released"
                    )
                row = _row_of_stop(stop)
                session.add(row)
                return _stop_of_row(row)

        return again_after_conflict(once)

    def stop_bench_once(self, stop: BenchStop) -> None:
        same = select(BenchStopRow.id).where(BenchStopRow.bench == stop.bench, BenchStopRow.reason == stop.reason)
        with self._database.write() as session:
            self._database.one_at_a_time(session, f"stop bench {stop.bench}")
            if session.scalar(same.where(_STANDS).limit(1)) is None:
                session.add(_row_of_stop(stop))

    def confirm_safe(self, bench_id: str, at: datetime, by: str) -> None:
        unconfirmed = BenchStopRow.safe_at.is_(None)
        query = update(BenchStopRow).where(BenchStopRow.bench == bench_id, _STANDS, unconfirmed)
        with self._database.write() as session:
            session.execute(query.values(safe_at=at, safe_by=by))

    def release_stop(self, bench_id: str, stop_id: str, at: datetime, by: str, remark: str) -> BenchStop:
        with self._database.write() as session:
            row = session.get(BenchStopRow, stop_id, with_for_update=True)
            if row is None or row.bench != bench_id:
                raise NotFound("stop", stop_id, f"bench {bench_id} has none with this id")
            if row.released_at is None:
                row.released_at, row.released_by, row.remark = at, by, remark
            elif (row.released_by, row.remark) != (by, remark):
                when = row.released_at.isoformat()
                raise IllegalTransition(f"stop {stop_id} was released before, at {when} by {row.released_by}")
            return _stop_of_row(row)

    def standing_stops(self, bench_id: str) -> tuple[BenchStop, ...]:
        with self._database.read() as session:
            return standing_stops(session, bench_id)

    def stored_stops(self, ids: Iterable[str]) -> tuple[BenchStop, ...]:
        with self._database.read() as session:
            rows = session.scalars(select(BenchStopRow).where(BenchStopRow.id.in_(list(ids))))
            return tuple(map(_stop_of_row, rows))

    def bench_stop(self, bench_id: str) -> BenchStop | None:
        with self._database.read() as session:
            return next(iter(standing_stops(session, bench_id, limit=1)), None)

    def stops(self, bench_id: str, *, after: str | None = None, limit: int = 50) -> Page[BenchStop]:
        query = select(BenchStopRow).where(BenchStopRow.bench == bench_id)
        with self._database.read() as session:
            return page(session, query, BenchStopRow.id, after, limit, _stop_of_row)


def standing_stops(session: Session, bench_id: str, limit: int | None = None) -> tuple[BenchStop, ...]:
    """Return at most `limit` standing stops of a bench, oldest first."""
    query = select(BenchStopRow).where(BenchStopRow.bench == bench_id, _STANDS)
    ordered = query.order_by(BenchStopRow.at, BenchStopRow.id).limit(limit)
    return tuple(map(_stop_of_row, session.scalars(ordered)))


def _row_of_stop(stop: BenchStop) -> BenchStopRow:
    fields = {name: getattr(stop, name) for name in _FIELDS}
    return BenchStopRow(
        **{**fields, "entered_at": wall_clock.now()}
    )  # now, not before: a lock may have been waited for


def _stop_of_row(row: BenchStopRow) -> BenchStop:
    return BenchStop(**{name: getattr(row, name) for name in _FIELDS})
