"""The context of a job: its unit and bench as they were known, stored with the job as JSON.

The stored context names the unit's calibrations by their ids: their coefficients are stored once, with them.
"""

from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import cache
from typing import Any

from pydantic import TypeAdapter

from bench_service.model.calibrations import StoredCalibration
from bench_service.model.errors import NotUnderstood
from bench_service.model.job import Job
from procedures.core.errors import DomainError
from procedures.procedure import Context


@cache
def _adapter() -> TypeAdapter[Context]:
    """Build what reads and writes contexts when the first one comes: it takes as long as the imports of a room."""
    return TypeAdapter(Context)


def context_document(context: Context) -> dict[str, Any]:
    """Return the context of a job as a JSON object, without the coefficients of calibrations that have an id."""
    unit = context.unit
    stored = len(unit.calibration_ids) == len(unit.calibrations)
    return _adapter().dump_python(context, mode="json", exclude={"unit": {"calibrations"}} if stored else None)


def context_of(job: Job, calibrations: Callable[[Sequence[str]], Sequence[StoredCalibration]]) -> Context:
    """Return a job's context, read back from JSON, with the `calibrations` that it names. Raises `NotUnderstood`."""
    try:
        context = _adapter().validate_python({**job.context, "unit": unit_document(job.context)})
    except (ValueError, DomainError) as error:
        raise NotUnderstood(job.id, job.code_version, error) from error
    unit = context.unit
    if not unit.calibration_ids or unit.calibrations:
        return context
    return replace(context, unit=replace(unit, calibrations=tuple(c.value for c in calibrations(unit.calibration_ids))))


def withheld_calibration(job: Job, triads: Sequence[str]) -> str:
    """Return the reason why a calibration that a job needs may not be used, as its context says; empty where all
    may.
    """
    unit = unit_document(job.context)
    return "; ".join(entry["why"] for entry in unit.get("withheld") or () if entry["subject"] in triads)


def unit_document(context: dict[str, Any]) -> dict[str, Any]:
    """The unit of a stored context as this release reads it; {} where there is none.

    Contexts of earlier versions call the subject of what was withheld its triad, also where it was a correction.
    """
    unit: dict[str, Any] = context.get("unit") or {}
    withheld: list[dict[str, Any]] = unit.get("withheld") or []
    if not any("triad" in entry for entry in withheld):
        return unit
    renamed = [{"subject" if key == "triad" else key: value for key, value in entry.items()} for entry in withheld]
    return {**unit, "withheld": renamed}
