"""A certificate as an XML tree, from an exported calibration (`calibration_exports.own_json`) and a laboratory's file.

Each triad is one result: a list of its twelve coefficients with expanded uncertainties (k = 2) and their whole
covariance, whose factor is that of the region of all coefficients that were estimated. The JSON itself is attached.
"""

import base64
import re
from collections.abc import Mapping
from math import sqrt
from typing import Any

from bench_service.formats.certificate.laboratory import Contact, Laboratory
from bench_service.formats.certificate.tree import Element, etree
from procedures.importing import IMPORTING

DCC, SI = "https://ptb.de/dcc", "https://ptb.de/si"
VERSION = "3.3.0"
SPACES = {"dcc": DCC, "si": SI}
FACTOR, PROBABILITY = 2.0, 0.9545
"""Coverage factor of each coefficient, and the probability of a normal distribution that belongs to it."""
REGION = 0.95
ATTACHED = "calibration.json"
UNITS = {
    "rad/s": r"\radian\second\tothe{-1}",
    "m/s^2": r"\metre\second\tothe{-2}",
    "1": r"\one",
    "count": r"\one",
    "count/(rad/s)": r"\second\radian\tothe{-1}",
    "count/(m/s^2)": r"\second\tothe{2}\metre\tothe{-1}",
}
CONFORMITY = {
    "pass": "pass",
    "conditional pass": "conditionalPass",
    "conditional fail": "conditionalFail",
    "fail": "fail",
}
"""Verdict, or outcome of a statement of conformity -> its word in a certificate; others have none and are text."""
FORBIDDEN = re.compile("[\x00-\x08\x0b\x0c\x0e-\x1f\ufffe\uffff]")
"""Characters that XML cannot hold."""
DECISION_RULE = "simple acceptance: the value is compared with its limit, its uncertainty is not taken off"
"""Rule of results that were stored before their rule was."""


def certificate(document: Mapping[str, Any], text: str, laboratory: Laboratory, software: str) -> Element:
    """Return the certificate of an exported calibration as an XML tree, unsigned. `text`: the JSON as exported;
    `software`: its release. Raises `CertificateRefused`.
    """
    root = etree.Element(f"{{{DCC}}}digitalCalibrationCertificate", nsmap=SPACES, schemaVersion=VERSION)
    _administrative(_dcc(root, "administrativeData"), document, laboratory, software)
    results = _dcc(root, "measurementResults")
    for triad in document["triads"]:
        _measurement(_dcc(results, "measurementResult"), triad, laboratory)
    attached = _dcc(root, "document")
    for name, value in (
        ("fileName", ATTACHED),
        ("mimeType", "application/json"),
        ("dataBase64", base64.b64encode(text.encode()).decode()),
    ):
        _dcc(attached, name, value)
    etree.indent(root)
    return root


def _dcc(parent: Element, name: str, text: str | None = None) -> Element:
    child = etree.SubElement(parent, f"{{{DCC}}}{name}")
    child.text = None if text is None else FORBIDDEN.sub(" ", text)
    return child


def _si(parent: Element, name: str, text: str | None = None) -> Element:
    child = etree.SubElement(parent, f"{{{SI}}}{name}")
    child.text = text
    return child


def _worded(parent: Element, name: str, text: str) -> Element:
    """An element whose content is text in a language."""
    child = _dcc(parent, name)
    _dcc(child, "content", text).set("lang", "en")
    return child


def _administrative(parent: Element, document: Mapping[str, Any], laboratory: Laboratory, software: str) -> None:
    program = _dcc(_dcc(parent, "dccSoftware"), "software")
    _worded(program, "name", "bench")
    _dcc(program, "release", software)
    core = _dcc(parent, "coreData")
    ended = max(triad["made_at"][:10] for triad in document["triads"])
    begun = min(triad["made_at"][:10] for triad in document["triads"])
    for name, value in (
        ("countryCodeISO3166_1", laboratory.laboratory.country),
        ("usedLangCodeISO639_1", "en"),
        ("mandatoryLangCodeISO639_1", "en"),
        ("uniqueIdentifier", laboratory.identifier),
        ("beginPerformanceDate", begun if laboratory.begun is None else laboratory.begun.isoformat()),
        ("endPerformanceDate", ended),
        ("performanceLocation", "laboratory"),
    ):
        _dcc(core, name, value)
    item = _dcc(_dcc(parent, "items"), "item")
    _worded(item, "name", laboratory.item)
    serial = _dcc(_dcc(item, "identifications"), "identification")
    _dcc(serial, "issuer", "manufacturer")
    _dcc(serial, "value", document["unit"])
    _worded(serial, "name", "serial")
    _contact(_dcc(_dcc(parent, "calibrationLaboratory"), "contact"), laboratory.laboratory)
    people = _dcc(parent, "respPersons")
    for person in laboratory.people:
        one = _dcc(people, "respPerson")
        _worded(_dcc(one, "person"), "name", person.name)
        _dcc(one, "role", person.role)
        _dcc(one, "mainSigner", str(person.main_signer).lower())
    _contact(_dcc(parent, "customer"), laboratory.customer)
    statements = _dcc(parent, "statements")
    for remark in document["remarks"]:
        _dcc(_dcc(_dcc(statements, "statement"), "declaration"), "content", remark).set("lang", "en")


def _contact(parent: Element, contact: Contact) -> None:
    _worded(parent, "name", contact.name)
    if contact.email:
        _dcc(parent, "eMail", contact.email)
    place = _dcc(parent, "location")
    for name, value in (
        ("street", contact.street),
        ("postCode", contact.post_code),
        ("city", contact.city),
        ("countryCode", contact.country),
    ):
        if value:
            _dcc(place, name, value)


def _measurement(parent: Element, triad: Mapping[str, Any], laboratory: Laboratory) -> None:
    _worded(parent, "name", f"calibration of the {triad['triad']} triad")
    method = _dcc(_dcc(parent, "usedMethods"), "usedMethod")
    lineage = triad["lineage"] or {}
    _worded(method, "name", f"{triad['method']} {lineage.get('version', '')}".strip())
    _worded(method, "description", f"U = b + K·v; {_source(triad)}")
    if laboratory.equipment:
        _equipment(_dcc(parent, "measuringEquipments"), laboratory)
    result = _dcc(_dcc(parent, "results"), "result")
    _worded(result, "name", f"coefficients of the {triad['triad']}s: {' '.join(triad['covariance']['order'])}")
    quantity = _dcc(_dcc(result, "data"), "quantity")
    _coefficients(_si(quantity, "realListXMLList"), triad)
    meta = _dcc(_dcc(parent, "measurementMetaData"), "metaData")
    _worded(meta, "name", "verdict")
    statement = lineage.get("statement") or {}
    outcome, rule = statement.get("outcome") or triad["validity"]["verdict"], statement.get("rule") or DECISION_RULE
    _worded(meta, "description", f"verdict {outcome}; decision rule: {rule}")
    conformity = CONFORMITY.get(outcome or "")
    if conformity is not None:
        _dcc(meta, "conformity", conformity)


def _source(triad: Mapping[str, Any]) -> str:
    if triad["lineage"] is None:
        return f"coefficients as entered from {triad['origin']}"
    hashes = ", ".join(r["content_hash"] for r in triad["lineage"]["recordings"])
    at = "not set" if triad["temperature_c"] is None else " to ".join(f"{t:g} °C" for t in triad["temperature_c"])
    kind = "SIMULATED unit; " if triad["simulated"] else ""
    return f"{kind}chamber temperature {at}; raw data by SHA-256: {hashes}"


def _equipment(parent: Element, laboratory: Laboratory) -> None:
    for one in laboratory.equipment:
        device = _dcc(parent, "measuringEquipment")
        _worded(device, "name", one.name)
        if one.certificate:
            _worded(device, "description", f"certificate {one.certificate}")
        serial = _dcc(_dcc(device, "identifications"), "identification")
        _dcc(serial, "issuer", "manufacturer")
        _dcc(serial, "value", one.serial)


def _coefficients(parent: Element, triad: Mapping[str, Any]) -> None:
    with IMPORTING:
        from scipy.stats import chi2  # with all of scipy's statistics: only where it is called

    rows, covariance = triad["coefficients"], triad["covariance"]["matrix"]
    units = [UNITS[row["unit"]] for row in rows]
    _si(parent, "labelXMLList", " ".join(row["name"] for row in rows))
    _si(parent, "valueXMLList", " ".join(repr(row["value"]) for row in rows))
    _si(parent, "unitXMLList", " ".join(units))
    expanded = _si(_si(parent, "measurementUncertaintyUnivariateXMLList"), "expandedMUXMLList")
    _si(expanded, "valueExpandedMUXMLList", " ".join(repr(FACTOR * row["standard_uncertainty"]) for row in rows))
    _si(expanded, "coverageFactorXMLList", repr(FACTOR))
    _si(expanded, "coverageProbabilityXMLList", repr(PROBABILITY))
    region = _si(_si(parent, "measurementUncertaintyMultivariateXMLList"), "ellipsoidalRegionMUXMLList")
    matrix = _si(region, "covarianceMatrixXMLList")
    for j, of_column in enumerate(units):
        column = _si(matrix, "columnXMLList")
        for i, of_row in enumerate(units):
            one = _si(column, "covarianceXMLList")
            _si(one, "valueXMLList", repr(covariance[i][j]))
            _si(one, "unitXMLList", _product(of_row, of_column))
    estimated = sum(row["standard_uncertainty"] > 0 for row in rows) or 1
    _si(region, "coverageFactorXMLList", repr(sqrt(float(chi2.ppf(REGION, estimated)))))
    _si(region, "coverageProbabilityXMLList", repr(REGION))


def _product(a: str, b: str) -> str:
    """Unit of a product, in which a unit of one is not written."""
    return r"\one" if a == b == r"\one" else (a + b).replace(r"\one", "")
