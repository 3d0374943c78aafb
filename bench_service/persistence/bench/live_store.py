"""Live states of benches in SQL: one row for each bench, replaced at each update."""

from pydantic import TypeAdapter
from sqlalchemy import select

from bench_service.bench.live.values import BenchLive
from bench_service.persistence.database import Database
from bench_service.persistence.tables.bench import BenchLiveRow

LIVE = TypeAdapter(BenchLive)


class SqlLiveStore:
    """SQL implementation of `bench_service.bench.live.values.LiveStore`."""

    def __init__(self, database: Database) -> None:
        self._database = database

    def put(self, live: BenchLive) -> None:
        document = LIVE.dump_python(live, mode="json")
        with self._database.write() as session:
            session.merge(
                BenchLiveRow(
                    bench=live.bench,
                    at=live.at,
                    host=live.host,
                    process=live.process,
                    job_id=None if live.job is None else live.job.id,
                    document=document,
                )
            )

    def get(self, bench_id: str) -> BenchLive | None:
        with self._database.read() as session:
            row = session.get(BenchLiveRow, bench_id)
            return None if row is None else LIVE.validate_python(row.document)

    def all(self) -> tuple[BenchLive, ...]:
        with self._database.read() as session:
            rows = session.scalars(select(BenchLiveRow).order_by(BenchLiveRow.bench)).all()
        return tuple(LIVE.validate_python(row.document) for row in rows)
