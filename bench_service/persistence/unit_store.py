"""Units and benches in SQL: what is declared of them. Calibrations and corrections are the result
store's: only joined here."""

from collections.abc import Sequence
from datetime import datetime
from typing import Any

from pydantic import TypeAdapter
from sqlalchemy import bindparam, delete, select, update
from sqlalchemy.orm import aliased

from bench_service import wall_clock
from bench_service.jobs.errors import NotFound
from bench_service.jobs.stored import BenchStop
from bench_service.persistence.correction_rows import CORRECTION
from bench_service.persistence.database import Database
from bench_service.persistence.idempotency import again_after_conflict
from bench_service.persistence.result_rows import TRIADS
from bench_service.persistence.tables import BenchRow, BenchStopRow, CalibrationRow, UnitRow
from bench_service.persistence.tables_around_jobs import CorrectionRow
from procedures.bench import BenchDescription
from procedures.core.unit import Unit

UNIT = TypeAdapter(Unit)
BENCH = TypeAdapter(BenchDescription)
_JOINED = {
    "calibrations",
    "calibration_id",
    "thermal_correction",
    "thermal_correction_id",
    "converter",
    "converter_id",
}
"""What other tables know of a unit."""


class SqlUnitStore:
    """`bench_service.jobs.store.UnitStore`."""

    def __init__(self, database: Database) -> None:
        self._database = database

    def put_unit(self, unit: Unit) -> None:
        document = UNIT.dump_python(unit, mode="json", exclude=_JOINED)

        def once() -> None:
            with self._database.write() as session:
                session.merge(UnitRow(serial=unit.serial, document=document, updated_at=wall_clock.now()))

        again_after_conflict(once)

    def unit(self, serial: str) -> Unit:
        with self._database.read() as session:
            row = session.execute(_UNIT, {"serial": serial}).one_or_none()
        if row is None:
            raise NotFound("unit", serial)
        return _unit(*row)

    def units(self) -> tuple[Unit, ...]:
        with self._database.read() as session:
            rows = session.execute(_UNITS.order_by(UnitRow.serial)).all()
        return tuple(_unit(*row) for row in rows)

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


_THERMAL, _CONVERTER = aliased(CorrectionRow), aliased(CorrectionRow)
_UNITS = (
    select(
        UnitRow.document,
        CalibrationRow.triads,
        CalibrationRow.id,
        _THERMAL.document,
        _THERMAL.id,
        _CONVERTER.document,
        _CONVERTER.id,
    )
    .outerjoin(CalibrationRow, (CalibrationRow.unit == UnitRow.serial) & CalibrationRow.is_current)
    .outerjoin(_THERMAL, (_THERMAL.unit == UnitRow.serial) & (_THERMAL.kind == "thermal") & _THERMAL.is_current)
    .outerjoin(
        _CONVERTER, (_CONVERTER.unit == UnitRow.serial) & (_CONVERTER.kind == "converter") & _CONVERTER.is_current
    )
)

_UNIT = _UNITS.where(UnitRow.serial == bindparam("serial"))


def _unit(
    document: dict[str, Any],
    triads: list[Any] | None,
    calibration_id: str | None,
    thermal: dict[str, Any] | None,
    thermal_id: str | None,
    converter: dict[str, Any] | None,
    converter_id: str | None,
) -> Unit:
    joined: dict[str, Any] = {
        "calibrations": TRIADS.validate_python(triads or []),
        "calibration_id": calibration_id,
        "thermal_correction": None if thermal is None else CORRECTION.validate_python(thermal).thermal,
        "thermal_correction_id": thermal_id,
        "converter": None if converter is None else CORRECTION.validate_python(converter).converter,
        "converter_id": converter_id,
    }
    return UNIT.validate_python({**document, **joined})
