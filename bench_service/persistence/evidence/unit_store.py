"""Units in SQL, as they are declared. Calibrations and corrections belong to the result store: only joined here."""

from collections import defaultdict
from collections.abc import Collection, Sequence
from typing import Any

from pydantic import TypeAdapter
from sqlalchemy import select

from bench_service import wall_clock
from bench_service.evidence.corrections import StoredCorrection
from bench_service.model.calibrations import StoredCalibration
from bench_service.model.errors import NotFound
from bench_service.persistence.database import Database
from bench_service.persistence.evidence.calibration_rows import calibrations_where
from bench_service.persistence.evidence.correction_rows import corrections_where
from bench_service.persistence.idempotency import again_after_conflict
from bench_service.persistence.tables.evidence import CalibrationRow, CorrectionRow, UnitRow
from procedures.core.unit import Unit, Withheld

UNIT = TypeAdapter(Unit)
_JOINED = {
    "calibrations",
    "calibration_ids",
    "withheld",
    "thermal_correction",
    "thermal_correction_id",
    "converter",
    "converter_id",
    "thermometers",
    "thermometers_id",
    "gyro_correction",
    "gyro_correction_id",
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
            document = session.scalar(select(UnitRow.document).where(UnitRow.serial == serial))
            if document is None:
                raise NotFound("unit", serial)
            calibrations = calibrations_where(session, CalibrationRow.unit == serial, CalibrationRow.is_current)
            corrections = corrections_where(session, CorrectionRow.unit == serial, CorrectionRow.is_current)
        return _unit(document, calibrations, corrections)

    def serials(self) -> tuple[str, ...]:
        with self._database.read() as session:
            return tuple(session.scalars(select(UnitRow.serial).order_by(UnitRow.serial)))

    def units(self, serials: Collection[str] | None = None) -> tuple[Unit, ...]:
        of = lambda column: () if serials is None else (column.in_(serials),)  # noqa: E731
        with self._database.read() as session:
            query = select(UnitRow.document).where(*of(UnitRow.serial)).order_by(UnitRow.serial)
            documents = session.scalars(query).all()
            calibrations = calibrations_where(session, *of(CalibrationRow.unit), CalibrationRow.is_current)
            corrections = corrections_where(session, *of(CorrectionRow.unit), CorrectionRow.is_current)
        calibrated: dict[str, list[StoredCalibration]] = defaultdict(list)
        corrected: dict[str, list[StoredCorrection]] = defaultdict(list)
        for calibration in calibrations:
            calibrated[calibration.unit].append(calibration)
        for correction in corrections:
            corrected[correction.unit].append(correction)
        return tuple(_unit(d, calibrated[d["serial"]], corrected[d["serial"]]) for d in documents)


def _unit(
    document: dict[str, Any], calibrations: Sequence[StoredCalibration], corrections: Sequence[StoredCorrection]
) -> Unit:
    """The unit with its current calibrations and corrections; those that may not be used are withheld."""
    at = wall_clock.now()
    doubts = {c.id: c.unusable(at) for c in (*calibrations, *corrections)}
    usable = sorted((c for c in calibrations if not doubts[c.id]), key=lambda c: c.triad != "gyro")
    of_kind = {c.correction.kind: c for c in corrections if not doubts[c.id]}
    thermal, converter, thermometers = (of_kind.get(kind) for kind in ("thermal", "converter", "thermometers"))
    gyros = of_kind.get("gyros")
    subjects = [*((c.triad, c) for c in calibrations), *((c.correction.kind, c) for c in corrections)]
    joined: dict[str, Any] = {
        "calibrations": tuple(c.value for c in usable),
        "calibration_ids": tuple(c.id for c in usable),
        "withheld": tuple(Withheld(s, c.id, doubts[c.id]) for s, c in subjects if doubts[c.id]),
        "thermal_correction": thermal and thermal.correction.thermal,
        "thermal_correction_id": thermal and thermal.id,
        "converter": converter and converter.correction.converter,
        "converter_id": converter and converter.id,
        "thermometers": thermometers and thermometers.correction.thermometers,
        "thermometers_id": thermometers and thermometers.id,
        "gyro_correction": gyros and gyros.correction.gyros,
        "gyro_correction_id": gyros and gyros.id,
    }
    return UNIT.validate_python({**document, **joined})
