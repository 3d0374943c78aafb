"""The printed report of a result, whatever its procedure or method."""

import hashlib
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

from pydantic_core import to_json

from bench_service.evidence.catalogue import Catalogue
from bench_service.evidence.reports import (
    calibration_parts,
    condition_parts,
    context_parts,
    noise_parts,
    people_parts,
    record_parts,
)
from bench_service.evidence.stores import EvidenceStores
from bench_service.formats.printed.digits import to_uncertainty, two_digits
from bench_service.formats.printed.document import (
    Attachment,
    Block,
    Facts,
    Heading,
    Paragraph,
    PrintedDocument,
    PrintedTable,
    blocks_of,
)
from bench_service.model.calibrations import StoredCalibration
from bench_service.model.errors import NotFound
from bench_service.model.job import Job
from bench_service.model.records import StoredResult

SIMULATED = "SIMULATED: the data come from a simulated bench and no real unit."
RESULT = "result.json"
SIMPLE = "simple acceptance, the uncertainty of a value is not taken off"


@dataclass(frozen=True)
class ResultReport:
    """A result with all that its printed report is made of: its job, its calibrations, and those found before."""

    result: StoredResult
    job: Job | None
    calibrations: tuple[StoredCalibration, ...]
    """Calibrations that the result gave."""
    found: dict[str, StoredCalibration]
    """Triad -> the calibration that was in use when the job began."""


def gathered(stores: EvidenceStores, result: StoredResult, job: Job | None) -> ResultReport:
    """Return all that a result's report is made of, read from the stores."""
    given = stores.calibrations.of_results([result.id])
    return ResultReport(result, job, tuple(given), calibration_parts.found_before(stores, result))


def result_report(stores: EvidenceStores, catalogue: Catalogue, of: ResultReport) -> PrintedDocument:
    """Return the printed report of a result: identity, mounting, instruments, conditions, results, plots, verdict,
    people, hashes.
    """
    result, attached = of.result, _attached(of.result)
    blocks = [*_head(of), *context_parts.identity(result.context, result.unit or "none")]
    blocks += record_parts.found_and_left(stores, catalogue, result, of.found, of.calibrations, of.job)
    if result.unit:
        blocks += people_parts.remarks(stores.unit_notes.list(result.unit, limit=people_parts.REMARKS).items)
    recordings = [stores.recordings.get(known) for known, _ in result.recordings]
    if result.context:
        at = context_parts.recorded_at(result, of.job, recordings)
        blocks += [*context_parts.mounting(result.context), *context_parts.instruments(result.context, at)]
    blocks += condition_parts.conditions(result.context, recordings)
    blocks += _calibrations(stores, of)
    report = catalogue.report(result)
    sections = blocks_of(report)
    if sections:
        blocks += [Heading("Results in detail"), *([Paragraph(report.summary)] if report.summary else []), *sections]
    if result.unit and result.name == noise_parts.LAUNCHES:
        trends = tuple(noise_parts.noise_trends(stores, result.unit, result.simulated, result))
        blocks += [Heading("Noise of the unit from one static run to the next"), *trends] if trends else []
    blocks += [
        *people_parts.people(result, of.job),
        *context_parts.hashes(result.recordings),
        *_lineage(result, attached),
    ]
    return PrintedDocument(
        title=_title(catalogue, result),
        subject=", ".join(filter(None, (f"unit {result.unit}" if result.unit else "without a unit", _job(of.job)))),
        verdict=result.verdict.value.upper(),
        identifier=f"result {result.id}",
        at=result.created_at,
        blocks=tuple(blocks),
        attachments=(attached,),
    )


def _attached(result: StoredResult) -> Attachment:
    """The whole stored result as a file."""
    data = to_json(result, indent=1) + b"\n"
    return Attachment(RESULT, "application/json", data, "Data", "the result with every number unrounded")


def _title(catalogue: Catalogue, result: StoredResult) -> str:
    """Title of the procedure or method; its name where the catalogue has it no longer."""
    try:
        found = catalogue.procedure if result.kind == "procedure" else catalogue.method
        return found(result.name).title
    except NotFound:
        return result.name.replace("_", " ")


def _job(job: Job | None) -> str:
    return "" if job is None else f"job {job.number}"


def _head(of: ResultReport) -> Iterator[Block]:
    """The marks that must be seen first, and the verdict."""
    result = of.result
    if result.simulated:
        yield Paragraph(SIMULATED, warning=True)
    for one in of.calibrations:
        if one.approval.value == "rejected":
            yield Paragraph(f"NOT FOR USE: calibration {one.id} of the {one.triad} triad was rejected.", warning=True)
    yield from verdict_blocks(result)


def verdict_blocks(result: StoredResult) -> Iterator[Block]:
    """Yield the section on the verdict: its decision rule, its checks and the warnings."""
    yield Heading("Verdict")
    yield Paragraph(f"{result.verdict.value.upper()}. {_rule(result.document)}")
    checks = result.document.get("checks", [])
    if checks:
        yield _checks(checks)
    for warning in result.document.get("warnings", []):
        yield Paragraph(warning, warning=True)


def _rule(document: dict[str, Any]) -> str:
    """Decision rules of the checks in words; of a result without them, the one that held then."""
    rules = dict.fromkeys(c["decision"]["rule"] for c in document.get("checks", []) if c.get("decision"))
    return f"Decision rule: {'; '.join(rules) or SIMPLE}."


def _checks(checks: list[dict[str, Any]]) -> PrintedTable:
    rows = tuple(_check(c) for c in sorted(checks, key=lambda c: c["passed"]))
    columns = ("", "check", "value", "U", "k", "limit", "unit", "note")
    note = (
        "U = k·u is the expanded uncertainty; values have its second digit. Conditional: within U of the limit. "
        "Inconclusive: nothing was observed, and what it stays below is outside the limit."
    )
    return PrintedTable("Checks", columns, rows, (2, 3, 4), note)


def _check(c: dict[str, Any]) -> tuple[str, ...]:
    """Cells of one check; a result from before the decision rules has its factor of two."""
    limit, sd, decision = c["limit"], c.get("standard_uncertainty"), c.get("decision") or {}
    factor = decision.get("coverage_factor") or calibration_parts.FACTOR
    expanded = decision.get("expanded_uncertainty")
    if expanded is None and sd is not None:
        expanded = factor * sd
    bounds = [f"{sign} {limit[end]:g}" for end, sign in (("minimum", "≥"), ("maximum", "≤")) if limit[end] is not None]
    return (
        decision.get("outcome") or ("pass" if c["passed"] else "fail"),
        c["name"],
        "unbounded" if c["value"] is None else ("< " * c.get("bound", False)) + to_uncertainty(c["value"], expanded),
        "–" if expanded is None else two_digits(expanded),
        "–" if expanded is None else f"{factor:.3g}",
        " and ".join(bounds),
        limit["unit"],
        "; ".join(filter(None, (c.get("note", ""), limit.get("source") and f"limit: {limit['source']}"))),
    )


def _calibrations(stores: EvidenceStores, of: ResultReport) -> Iterator[Block]:
    """Coefficients as found and as left, and their trend up to this result."""
    for one in of.calibrations:
        yield from calibration_parts.found_and_left(stores, one, of.found.get(one.triad))
    if not of.calibrations and of.found:
        yield Heading("Calibrations in use")
        yield Paragraph("The result left the unit's calibrations as it found them.")
        for one in of.found.values():
            yield Facts((("triad", one.triad), *calibration_parts.facts(one)))


def _lineage(result: StoredResult, attached: Attachment) -> Iterator[Block]:
    yield Heading("Lineage")
    rows = [
        ("result", result.id),
        ("made by", f"{result.name} {result.version}"),
        ("code", result.code_version),
        ("calibrations used", ", ".join(result.calibrations) or "none"),
        ("corrections used", ", ".join(result.corrections) or "none"),
    ]
    if result.seed is not None:
        rows.append(("seed", str(result.seed)))
    rows.append((f"SHA-256 of {RESULT}", hashlib.sha256(attached.data).hexdigest()))
    yield Facts(tuple(rows))
    yield Paragraph(f"Parameters, and every number unrounded, are in the attached {RESULT}.")
