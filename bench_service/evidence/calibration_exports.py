"""Exports of calibrations: the stored record of a triad, with the other triad's, in the form that a program reads."""

from collections.abc import Sequence
from datetime import datetime
from typing import Any

from bench_service.evidence.stores import EvidenceStores
from bench_service.formats.calibration_exports.forms import (
    CalibrationForm,
    ExportedCalibration,
    exported,
    takes_one_triad,
)
from bench_service.formats.calibration_exports.subject import SI_UNITS, CalibrationSubject, TriadExport
from bench_service.mapping import copied
from bench_service.model.calibrations import StoredCalibration
from bench_service.model.errors import NotFound
from bench_service.model.records import StoredResult
from bench_service.wall_clock import now
from procedures.core.errors import BadParameter


def calibration_subject(
    stores: EvidenceStores, unit: str, calibration_id: str, other: str | None
) -> CalibrationSubject:
    """Return the calibration of one triad, with that of the other one: `other`, else of the same result, else the
    current one.

    A current calibration that may not be used is not added by itself. Raises `NotFound`, `BadParameter`.
    """
    asked = _of_unit(stores, unit, calibration_id)
    chosen = [asked]
    if other is not None:
        second = _of_unit(stores, unit, other)
        if second.triad == asked.triad:
            raise BadParameter("other", other, f"a calibration of the other triad: both are of the {asked.triad}s")
        chosen.append(second)
    elif (found := _other(stores, asked)) is not None:
        chosen.append(found)
    chosen.sort(key=lambda c: list(SI_UNITS).index(c.triad))
    record = stores.units.unit(unit)
    known = {name: triad for name in SI_UNITS if (triad := record.triad(name)) is not None}
    return CalibrationSubject(
        unit=unit,
        rate_hz=record.sample_rate_hz,
        triads=tuple(_triad(stores, c) for c in chosen),
        asked=calibration_id,
        exported_at=_text(now()) or "",
        noise={name: triad.observed_noise for name, triad in known.items()},
        noise_origin={name: triad.noise_origin for name, triad in known.items()},
    )


def export_calibration(
    stores: EvidenceStores, unit: str, calibration_id: str, form: CalibrationForm, other: str | None = None
) -> ExportedCalibration:
    """Return a calibration as a file for other software, with its name and media type. Raises `NotFound`,
    `BadParameter` where the form cannot hold it.
    """
    subject = calibration_subject(stores, unit, calibration_id, other)
    if other is None and takes_one_triad(form) and form is not CalibrationForm.KALIBR_IMU:
        subject = copied(
            CalibrationSubject,
            subject,
            triads=tuple(t for t in subject.triads if _belongs(t, subject.triads, calibration_id)),
        )
    return exported(subject, form)


def _belongs(one: TriadExport, all_of_them: Sequence[TriadExport], asked: str) -> bool:
    """Whether a triad goes into a form that can hold one alone: the asked one, and one of the same result."""
    main = next(t for t in all_of_them if t.id == asked)
    of = [None if t.lineage is None else t.lineage["result"] for t in (one, main)]
    return one is main or (of[0] is not None and of[0] == of[1])


def _of_unit(stores: EvidenceStores, unit: str, calibration_id: str) -> StoredCalibration:
    stored = stores.calibrations.get(calibration_id)
    if stored.unit != unit:
        raise NotFound("calibration", calibration_id, f"unit {unit} has none with this id")
    return stored


def _other(stores: EvidenceStores, asked: StoredCalibration) -> StoredCalibration | None:
    if asked.result_id is not None:
        for one in stores.calibrations.of_results([asked.result_id]):
            if one.triad != asked.triad:
                return one
    current = [c for c in stores.calibrations.current(asked.unit) if c.triad != asked.triad]
    return next((c for c in current if not c.unusable(now())), None)


def _triad(stores: EvidenceStores, one: StoredCalibration) -> TriadExport:
    made_by = None if one.result_id is None else stores.results.get(one.result_id)
    return copied(
        TriadExport,
        one,
        verdict=None if one.verdict is None else one.verdict.value,
        made_at=_text(one.made_at),
        approval=one.approval.value,
        unusable=one.unusable(now()),
        valid_from=_text(one.valid_from),
        valid_until=_text(one.valid_until),
        temperature_c=None if made_by is None else _temperature(stores, made_by),
        lineage=None if made_by is None else _lineage(made_by),
        mounting=None if made_by is None else made_by.context.get("mounting"),
    )


def _temperature(stores: EvidenceStores, result: StoredResult) -> tuple[float, float] | None:
    """Lowest and highest temperature to which the chamber was set for the result's recordings."""
    stations = (stores.recordings.get(recording).info.station for recording, _ in result.recordings)
    found = [s.temperature_c for s in stations if s is not None and s.temperature_c is not None]
    return (min(found), max(found)) if found else None


def _lineage(result: StoredResult) -> dict[str, Any]:
    return {
        "result": result.id,
        "name": result.name,
        "version": result.version,
        "parameters": result.parameters,
        "recordings": [{"id": i, "content_hash": h} for i, h in result.recordings],
        "calibrations": list(result.calibrations),
        "corrections": list(result.corrections),
        "code_version": result.code_version,
        "job": result.job_id,
        "statement": result.document.get("statement"),
    }


def _text(moment: datetime | None) -> str | None:
    return None if moment is None else moment.isoformat(timespec="seconds")
