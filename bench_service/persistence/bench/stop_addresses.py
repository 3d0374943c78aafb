"""Addresses where the supervisors of benches listen for stops, kept in the benches' own rows.

A bench that is registered again loses its address; its supervisor writes it again at its next poll.
"""

from sqlalchemy import select

from bench_service.bench.stop.messages import Listening
from bench_service.persistence.database import Database
from bench_service.persistence.tables.bench import BenchRow

KEY = "stops_taken_at"


class SqlStopAddresses:
    """SQL store of the addresses where supervisors take stops: written by supervisors and read by every API process."""

    def __init__(self, database: Database) -> None:
        self._database = database

    def all(self) -> dict[str, Listening]:
        """Return the addresses by bench; benches without one are left out. Raises `StorageFailure`."""
        with self._database.read() as session:
            rows = session.execute(select(BenchRow.id, BenchRow.document)).all()
        return {name: Listening(**document[KEY]) for name, document in rows if KEY in document}

    def say(self, bench_id: str, at: Listening) -> None:
        """Store the address where a bench's supervisor listens. Raises `StorageFull`, `StorageFailure`."""
        said = {"address": at.address, "host": at.host}
        with self._database.read() as session:
            document = session.scalar(select(BenchRow.document).where(BenchRow.id == bench_id))
        if document is None or document.get(KEY) == said:
            return
        with self._database.write() as session:
            row = session.get(BenchRow, bench_id, with_for_update=True)
            if row is not None:
                row.document = {**row.document, KEY: said}
