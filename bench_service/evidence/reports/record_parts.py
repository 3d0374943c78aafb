"""The unit's record in a printed report: noise and what is in use, as a job found them and as its result left them."""

from collections.abc import Iterator, Mapping, Sequence
from functools import cache

from pydantic import TypeAdapter, ValidationError

from bench_service.evidence.catalogue import Catalogue
from bench_service.evidence.reports.noise_parts import noise_change, origin
from bench_service.evidence.stores import EvidenceStores
from bench_service.formats.printed.document import Block, PrintedTable
from bench_service.model.calibrations import StoredCalibration
from bench_service.model.context import unit_document
from bench_service.model.errors import NotFound
from bench_service.model.job import Job
from bench_service.model.records import StoredResult
from procedures.core.errors import DomainError
from procedures.core.recording import TRIADS
from procedures.core.unit import CORRECTION_IDS, TriadRecord, Unit


def found_and_left(
    stores: EvidenceStores,
    catalogue: Catalogue,
    result: StoredResult,
    found: Mapping[str, StoredCalibration],
    given: Sequence[StoredCalibration],
    job: Job | None,
) -> Iterator[Block]:
    """Yield the section on what was in use when the job began next to what the result gave, and noise where it changed.
    `found` by triad; `given`: calibrations of the result; `job` None: a result of a method.
    """
    unit = result.context.get("unit")
    if not unit:
        return
    left = {c.triad: c.id for c in given}
    rows = [
        (f"calibration of the {triad}s", before.id if (before := found.get(triad)) else "none", left.get(triad, "same"))
        for triad in TRIADS
    ]
    gave = _corrections(stores, result)
    for kind, field in CORRECTION_IDS.items():
        if unit.get(field) or kind in gave:
            rows.append((f"correction: {kind}", unit.get(field) or "none", gave.get(kind, "same")))
    before, after = _units(catalogue, result, job is not None and job.result_id == result.id)
    if before is not None and after is not None:
        rows += [
            (f"noise of the {triad}s", origin(before.triad(triad)), _changed(before.triad(triad), after.triad(triad)))
            for triad in TRIADS
        ]
        rows.append(("averaging time", f"{before.averaging_time_s:g} s", f"{after.averaging_time_s:g} s"))
    note = "As left: what this result gave; a calibration comes into use by the rule or by a person's choice."
    yield PrintedTable("Record of the unit", ("", "as found", "as left"), tuple(rows), (), note)
    if before is not None and after is not None:
        yield from noise_change(before, after)


def _corrections(stores: EvidenceStores, result: StoredResult) -> dict[str, str]:
    """Kind -> id of the corrections that the result gave."""
    if result.unit is None:
        return {}
    found = stores.corrections.list(result.unit, limit=200).items
    return {c.correction.kind: c.id for c in found if c.result_id == result.id}


@cache
def _adapter() -> TypeAdapter[Unit]:
    return TypeAdapter(Unit)


def _units(catalogue: Catalogue, result: StoredResult, of_job: bool) -> tuple[Unit | None, Unit | None]:
    """The unit as the job found it, and as the job's own result left it; None where this release cannot read one."""
    try:
        before = _adapter().validate_python(unit_document(result.context))
        if not of_job:
            return before, before
        entry = catalogue.procedure(result.name)
        return before, entry.learns(entry.result.model_validate(result.document), before, f"result {result.id}")
    except (ValidationError, ValueError, DomainError, NotFound):
        return None, None


def _changed(before: TriadRecord | None, after: TriadRecord | None) -> str:
    return "same" if before == after else origin(after)
