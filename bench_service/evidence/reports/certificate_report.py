"""The printed form of a digital calibration certificate: its own facts, with the plots of the results behind it."""

import json
from collections.abc import Callable, Iterator
from typing import Any

from bench_service.evidence.catalogue import Catalogue
from bench_service.evidence.reports import calibration_parts, condition_parts, context_parts, record_parts
from bench_service.evidence.reports.result_report import SIMULATED, verdict_blocks
from bench_service.evidence.stores import EvidenceStores
from bench_service.formats.certificate.document import DCC, SPACES
from bench_service.formats.certificate.errors import CertificateRefused
from bench_service.formats.certificate.rules import attached, faults
from bench_service.formats.certificate.signature import parsed
from bench_service.formats.certificate.tree import Element
from bench_service.formats.printed.document import (
    Attachment,
    Block,
    Facts,
    Heading,
    Paragraph,
    PrintedDocument,
    blocks_of,
)
from bench_service.model.calibrations import StoredCalibration
from bench_service.model.job import Job
from procedures.core.errors import BadParameter

CERTIFICATE = "certificate.xml"


def certificate_report(
    stores: EvidenceStores, catalogue: Catalogue, read_job: Callable[[str], Job], serial: str, xml: bytes
) -> PrintedDocument:
    """Return the printed form of a certificate as a document. Raises `BadParameter` for no certificate, or one whose
    numbers are not those stored here.
    """
    root, document, calibrations = _read(stores, serial, xml)
    results = {c.result_id: stores.results.get(c.result_id) for c in calibrations if c.result_id is not None}
    identifier = root.findtext(".//dcc:coreData/dcc:uniqueIdentifier", "", SPACES)
    blocks = [*_warnings(calibrations, document), *_parties(root)]
    found: dict[str, StoredCalibration] = {}
    for result in results.values():
        recordings = [stores.recordings.get(known) for known, _ in result.recordings]
        blocks += context_parts.identity(result.context, result.unit or "none")
        given = [c for c in calibrations if c.result_id == result.id]
        before = calibration_parts.found_before(stores, result)
        found |= before
        job = None if result.job_id is None else read_job(result.job_id)
        blocks += record_parts.found_and_left(stores, catalogue, result, before, given, job)
        at = context_parts.recorded_at(result, job, recordings)
        blocks += [*context_parts.mounting(result.context), *context_parts.instruments(result.context, at)]
        blocks += condition_parts.conditions(result.context, recordings)
    for one in calibrations:
        blocks += calibration_parts.found_and_left(stores, one, found.get(one.triad))
    for result in results.values():
        blocks += [*verdict_blocks(result), Heading("Results in detail"), *blocks_of(catalogue.report(result))]
        blocks += context_parts.hashes(result.recordings)
    blocks += _attached_facts(calibrations)
    return PrintedDocument(
        title=f"Calibration certificate {identifier}",
        subject=f"unit {document['unit']}",
        verdict=_verdict(calibrations),
        identifier=f"certificate {identifier}",
        at=max(c.made_at for c in calibrations),
        blocks=tuple(blocks),
        attachments=(
            Attachment(CERTIFICATE, "application/xml", xml, "Source", "digital calibration certificate, DCC 3.3.0"),
        ),
    )


def _read(stores: EvidenceStores, serial: str, xml: bytes) -> tuple[Element, dict[str, Any], list[StoredCalibration]]:
    """The certificate's tree, its attached document and the stored calibrations. Raises `BadParameter`."""
    try:
        root = parsed(xml)
        wrong = faults(root)
        document = {} if wrong else attached(root)
    except CertificateRefused as error:
        raise BadParameter("certificate", "the text sent", f"a digital calibration certificate: {error}") from error
    if wrong:
        raise BadParameter("certificate", "the text sent", f"a certificate without faults: {'; '.join(wrong)}")
    calibrations = [stores.calibrations.get(triad["calibration"]) for triad in document["triads"]]
    for triad, stored in zip(document["triads"], calibrations, strict=True):
        stated = [(row["name"], repr(row["value"])) for row in triad["coefficients"]]
        if not serial == stored.unit == document["unit"] or stated != [
            (c.name, repr(c.value)) for c in stored.coefficients
        ]:
            raise BadParameter("certificate", stored.id, "a certificate whose numbers are those stored here")
    return root, document, calibrations


def _warnings(calibrations: list[StoredCalibration], document: dict[str, Any]) -> Iterator[Block]:
    if any(c.simulated for c in calibrations):
        yield Paragraph(SIMULATED, warning=True)
    for triad in document["triads"]:
        if triad["validity"]["unusable"]:
            yield Paragraph(f"NOT FOR USE: {triad['validity']['unusable']}", warning=True)


def _parties(root: Element) -> Iterator[Block]:
    """Laboratory, customer, people and equipment, as the certificate states them."""
    yield Heading("Certificate")
    core = root.find(f".//{{{DCC}}}coreData")
    rows = [
        ("identifier", core.findtext("dcc:uniqueIdentifier", "", SPACES)),
        (
            "performed",
            f"{core.findtext('dcc:beginPerformanceDate', '', SPACES)} to "
            f"{core.findtext('dcc:endPerformanceDate', '', SPACES)}",
        ),
        ("laboratory", _contact(root.find(".//dcc:calibrationLaboratory/dcc:contact", SPACES))),
        ("customer", _contact(root.find(".//dcc:customer", SPACES))),
    ]
    for person in root.findall(".//dcc:respPerson", SPACES):
        name = person.findtext("dcc:person/dcc:name/dcc:content", "", SPACES)
        signs = ", signs" if person.findtext("dcc:mainSigner", "", SPACES) == "true" else ""
        rows.append((person.findtext("dcc:role", "person", SPACES), f"{name}{signs}"))
    seen: set[str] = set()
    for one in root.findall(".//dcc:measuringEquipment", SPACES):
        name, said, serial = (
            one.findtext(path, "", SPACES)
            for path in ("dcc:name/dcc:content", "dcc:description/dcc:content", "dcc:identifications//dcc:value")
        )
        text = ", ".join(filter(None, (f"serial {serial}", said)))
        if (name + text) not in seen:
            rows.append((name, text))
        seen.add(name + text)
    yield Facts(tuple(rows))


def _contact(one: Element) -> str:
    parts = ("name/dcc:content", "location/dcc:street", "location/dcc:postCode", "location/dcc:city")
    words = [one.findtext(f"dcc:{part}", "", SPACES) for part in (*parts, "location/dcc:countryCode", "eMail")]
    return ", ".join(filter(None, words))


def _verdict(calibrations: list[StoredCalibration]) -> str:
    words = {c.verdict.value.upper() for c in calibrations if c.verdict is not None}
    return words.pop() if len(words) == 1 else ""


def _attached_facts(calibrations: list[StoredCalibration]) -> Iterator[Block]:
    yield Heading("Attached")
    yield Paragraph(
        f"This file has {CERTIFICATE} inside: the same certificate for machines, with its signature, the whole "
        f"covariance and {json.dumps([c.id for c in calibrations])} as JSON. `bench certificate check` checks it, also "
        "from this PDF. The signature is of the XML, not of these pages."
    )
