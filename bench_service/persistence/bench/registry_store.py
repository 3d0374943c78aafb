"""Benches in SQL, as their workers registered them, and the stops that stand."""

from collections.abc import Sequence
from datetime import datetime
from typing import Any

from pydantic import TypeAdapter
from sqlalchemy import delete, select, update

from bench_service import wall_clock
from bench_service.model.errors import NotFound
from bench_service.model.records import BenchStop
from bench_service.persistence.database import Database
from bench_service.persistence.idempotency import again_after_conflict
from bench_service.persistence.tables.bench import BenchRow, BenchStopRow
from procedures.bench import BenchDescription

BENCH = TypeAdapter(BenchDescription)


class SqlBenchRegistry:
    """`bench_service.bench.registry.BenchRegistry`."""

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

    def stop_bench(self, stop: BenchStop) -> None:
        def once() -> None:
            with self._database.write() as session:
                if session.get(BenchStopRow, stop.bench) is None:
                    row = BenchStopRow(bench=stop.bench, at=stop.at, reason=stop.reason)
                    row.safe_at, row.safe_by = stop.safe_at, stop.safe_by
                    session.add(row)

        again_after_conflict(once)

    def confirm_safe(self, bench_id: str, at: datetime, by: str) -> None:
        query = update(BenchStopRow).where(BenchStopRow.bench == bench_id, BenchStopRow.safe_at.is_(None))
        with self._database.write() as session:
            session.execute(query.values(safe_at=at, safe_by=by))

    def release_bench(self, bench_id: str) -> None:
        with self._database.write() as session:
            session.execute(delete(BenchStopRow).where(BenchStopRow.bench == bench_id))

    def bench_stop(self, bench_id: str) -> BenchStop | None:
        with self._database.read() as session:
            row = session.get(BenchStopRow, bench_id)
            return None if row is None else BenchStop(row.bench, row.at, row.reason, row.safe_at, row.safe_by)
