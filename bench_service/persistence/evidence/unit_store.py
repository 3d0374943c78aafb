"""Units in SQL, as they are declared. Calibrations and corrections belong to the result store: only joined here."""

from collections import defaultdict
from collections.abc import Sequence
from typing import Any

from pydantic import TypeAdapter
from sqlalchemy import bindparam, select
from sqlalchemy.orm import aliased

from bench_service import wall_clock
from bench_service.model.calibrations import StoredCalibration
from bench_service.model.errors import NotFound
from bench_service.persistence.database import Database
from bench_service.persistence.evidence.calibration_rows import calibrations_where
from bench_service.persistence.evidence.correction_rows import CORRECTION
from bench_service.persistence.idempotency import again_after_conflict
from bench_service.persistence.tables.evidence import CalibrationRow, CorrectionRow, UnitRow
from procedures.core.unit import Unit, WithheldCalibration

UNIT = TypeAdapter(Unit)
_JOINED = {
    "calibrations",
    "calibration_ids",
    "withheld",
    "thermal_correction",
    "thermal_correction_id",
    "converter",
    "converter_id",
}
"""Fields of a unit that are stored in other tables."""


class SqlUnitStore:
    """SQL implementation of `bench_service.evidence.units.UnitStore`."""

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
            current = calibrations_where(session, CalibrationRow.unit == serial, CalibrationRow.is_current)
        return _unit(current, *row)

    def units(self) -> tuple[Unit, ...]:
        with self._database.read() as session:
            rows = session.execute(_UNITS.order_by(UnitRow.serial)).all()
            current = calibrations_where(session, CalibrationRow.is_current)
        of_unit: dict[str, list[StoredCalibration]] = defaultdict(list)
        for calibration in current:
            of_unit[calibration.unit].append(calibration)
        return tuple(_unit(of_unit[row[0]["serial"]], *row) for row in rows)


_THERMAL, _CONVERTER = aliased(CorrectionRow), aliased(CorrectionRow)
_UNITS = (
    select(
        UnitRow.document,
        _THERMAL.document,
        _THERMAL.id,
        _CONVERTER.document,
        _CONVERTER.id,
    )
    .outerjoin(_THERMAL, (_THERMAL.unit == UnitRow.serial) & (_THERMAL.kind == "thermal") & _THERMAL.is_current)
    .outerjoin(
        _CONVERTER, (_CONVERTER.unit == UnitRow.serial) & (_CONVERTER.kind == "converter") & _CONVERTER.is_current
    )
)

_UNIT = _UNITS.where(UnitRow.serial == bindparam("serial"))


def _unit(
    current: Sequence[StoredCalibration],
    document: dict[str, Any],
    thermal: dict[str, Any] | None,
    thermal_id: str | None,
    converter: dict[str, Any] | None,
    converter_id: str | None,
) -> Unit:
    at = wall_clock.now()
    doubts = {c.id: c.unusable(at) for c in current}
    usable = sorted((c for c in current if not doubts[c.id]), key=lambda c: c.triad != "gyro")
    joined: dict[str, Any] = {
        "calibrations": tuple(c.value for c in usable),
        "calibration_ids": tuple(c.id for c in usable),
        "withheld": tuple(WithheldCalibration(c.triad, c.id, doubts[c.id]) for c in current if doubts[c.id]),
        "thermal_correction": None if thermal is None else CORRECTION.validate_python(thermal).thermal,
        "thermal_correction_id": thermal_id,
        "converter": None if converter is None else CORRECTION.validate_python(converter).converter,
        "converter_id": converter_id,
    }
    return UNIT.validate_python({**document, **joined})
