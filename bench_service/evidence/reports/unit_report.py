"""The printed report of a unit: its record, its calibrations with their history, and its latest results."""

from collections.abc import Iterator
from datetime import datetime

from bench_service.evidence.corrections import StoredCorrection
from bench_service.evidence.reports import calibration_parts, noise_parts, people_parts
from bench_service.evidence.stores import EvidenceStores
from bench_service.formats.printed.document import Block, Facts, Heading, Paragraph, PrintedDocument, PrintedTable
from bench_service.model.calibrations import StoredCalibration
from bench_service.model.records import StoredResult
from procedures.core.recording import TRIADS
from procedures.core.unit import Unit

RESULTS = 20
"""Newest results that the report lists."""


def unit_report(stores: EvidenceStores, serial: str) -> PrintedDocument:
    """Return the printed report of a unit as it is known now. Raises `NotFound`."""
    unit = stores.units.unit(serial)
    history = stores.calibrations.list(serial, limit=200).items
    results = stores.results.list(unit=serial, limit=RESULTS).items
    corrections = stores.corrections.list(serial, limit=200).items
    notes = stores.unit_notes.list(serial, limit=people_parts.REMARKS).items
    blocks: list[Block] = [*_identity(unit), *people_parts.remarks(notes), *_noise(stores, unit, results)]
    blocks += [*_calibrations(stores, history), *_corrections(corrections), *_results(results)]
    moments = [c.made_at for c in (*history, *corrections)] + [r.created_at for r in results] + [n.at for n in notes]
    moments += [d.at for c in (*history, *corrections) for d in c.decisions]
    newest = max(moments, default=datetime.fromisoformat("1970-01-01T00:00:00+00:00"))
    return PrintedDocument("Unit", f"unit {serial}", "", f"unit {serial}", newest, tuple(blocks))


def _identity(unit: Unit) -> Iterator[Block]:
    yield Heading("Identity")
    declared = unit.declaration
    rows = [("serial", unit.serial)]
    if declared is not None:
        rows += [
            ("model", declared.model or "–"),
            ("part", declared.part or "–"),
            ("firmware", declared.firmware or "–"),
        ]
    rows.append(("sample rate", f"{unit.sample_rate_hz:g} Hz"))
    rows.append(("channels", ", ".join(c.name for c in unit.channels)))
    yield Facts(tuple(rows))
    for withheld in unit.withheld:
        yield Paragraph(withheld.why, warning=True)
    stated = [
        (c.state, c.day, c.certificate, c.triad, ", ".join(f"{b:.6g}" for b in c.bias))
        for c in (declared.coefficients if declared is not None else ())
    ]
    if stated:
        columns = ("state", "day", "certificate", "triad", "bias")
        yield PrintedTable("Coefficients by former certificates", columns, tuple(stated))


def _noise(stores: EvidenceStores, unit: Unit, results: tuple[StoredResult, ...]) -> Iterator[Block]:
    """Noise in the unit's record, and its trend over static launches of the kind of the newest result."""
    yield Heading("Noise")
    known = list(noise_parts.noise(unit))
    yield from known or [Paragraph("Nothing is known of the unit's noise.")]
    if results:
        yield from noise_parts.noise_trends(stores, unit.serial, results[0].simulated)


def _calibrations(stores: EvidenceStores, history: tuple[StoredCalibration, ...]) -> Iterator[Block]:
    """The calibration in use of each triad beside that as found, then the history and its trends."""
    if any(c.simulated for c in history):
        yield Paragraph("SIMULATED: calibrations of this unit come from a simulated bench.", warning=True)
    for triad in TRIADS:
        of_triad = [c for c in history if c.triad == triad]
        current = next((c for c in of_triad if c.current), None)
        yield Heading(f"Calibration of the {triad} triad")
        if current is None:
            yield Paragraph("None is in use.")
        else:
            found = calibration_parts.found_by(stores, current, of_triad)
            where = f"The whole covariance is in the export of calibration {current.id}, format json."
            yield from calibration_parts.coefficients(current, found, where)
        yield from calibration_parts.trends(of_triad, triad)
    if history:
        rows = tuple(
            (
                c.made_at.date().isoformat(),
                c.triad,
                c.id,
                c.method,
                "in use" if c.current else "",
                c.verdict.value if c.verdict else "entered",
                c.approval.value,
            )
            for c in history
        )
        columns = ("day", "triad", "calibration", "method", "", "verdict", "approval")
        yield PrintedTable("History, newest first", columns, rows)


def _corrections(corrections: tuple[StoredCorrection, ...]) -> Iterator[Block]:
    """Temperature corrections of the unit, newest first; nothing where there are none."""
    if not corrections:
        return
    yield Heading("Temperature corrections")
    rows = tuple(
        (
            c.made_at.date().isoformat(),
            c.correction.kind,
            c.id,
            c.result_id,
            c.verdict.value,
            "in use" if c.current else "",
            c.approval.value,
        )
        for c in corrections
    )
    yield PrintedTable("", ("day", "kind", "correction", "result", "verdict", "", "approval"), rows)


def _results(results: tuple[StoredResult, ...]) -> Iterator[Block]:
    yield Heading("Latest results")
    rows = tuple((people_parts.moment(r.created_at), f"{r.name} {r.version}", r.id, r.verdict.value) for r in results)
    if rows:
        yield PrintedTable("", ("at", "procedure or method", "result", "verdict"), rows)
    else:
        yield Paragraph("None.")
