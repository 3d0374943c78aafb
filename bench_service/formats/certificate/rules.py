"""Rules of a certificate that its schema does not check: sizes, symmetry, signs, units, and the attached JSON."""

import base64
import binascii
import json
from pathlib import Path
from typing import Any

import numpy as np

from bench_service.formats.certificate.document import ATTACHED, DCC, FACTOR, SPACES, UNITS, VERSION
from bench_service.formats.certificate.errors import CertificateRefused
from bench_service.formats.certificate.tree import Element, etree
from procedures.core.arrays import Array


def faults(root: Element) -> list[str]:
    """Return the faults of a certificate by the rules that its schema does not check, a sentence each; empty where
    there is none.
    """
    found: list[str] = []
    if root.tag != f"{{{DCC}}}digitalCalibrationCertificate" or root.get("schemaVersion") != VERSION:
        return [f"no certificate of version {VERSION}: {etree.QName(root).localname} {root.get('schemaVersion')}"]
    lists = root.findall(".//si:realListXMLList", SPACES)
    for number, one in enumerate(lists, start=1):
        found += [f"result {number}: {fault}" for fault in _faults_of_list(one)]
    return found + _faults_of_attachment(root, lists)


def schema_faults(root: Element, folder: Path) -> list[str]:
    """Return the faults by the schema in a folder, ``v3.3.0/dcc.xsd``, a sentence each. Raises `CertificateRefused`
    where there is no schema.
    """
    file = folder / f"v{VERSION}" / "dcc.xsd"
    if not file.is_file():
        raise CertificateRefused(f"there is no {file}: the folder of the schema has v{VERSION}/dcc.xsd and its imports")
    schema = etree.XMLSchema(etree.parse(str(file)))
    schema.validate(root)
    return [f"line {entry.line}: {entry.message}" for entry in schema.error_log][:10]


def _words(parent: Element, path: str) -> list[str]:
    found = parent.find(path, SPACES)
    return [] if found is None or found.text is None else found.text.split()


def _numbers(parent: Element, path: str) -> Array:
    return np.array([float(word) for word in _words(parent, path)])


def _faults_of_list(one: Element) -> list[str]:
    uni = "si:measurementUncertaintyUnivariateXMLList/si:expandedMUXMLList"
    try:
        values, expanded = _numbers(one, "si:valueXMLList"), _numbers(one, f"{uni}/si:valueExpandedMUXMLList")
        factor = _numbers(one, f"{uni}/si:coverageFactorXMLList")
        columns = [
            [_numbers(cell, "si:valueXMLList") for cell in column.findall("si:covarianceXMLList", SPACES)]
            for column in one.findall(".//si:columnXMLList", SPACES)
        ]
    except ValueError as error:
        return [f"a number cannot be read: {error}"]
    n = len(values)
    units = _words(one, "si:unitXMLList")
    found = [f"unit {unit!r} is none of {', '.join(UNITS.values())}" for unit in units if unit not in UNITS.values()]
    if n != 12 or len(units) != n or len(expanded) != n or factor.tolist() != [FACTOR]:
        return [*found, f"{n} values, {len(units)} units, {len(expanded)} uncertainties, factor {factor.tolist()}"]
    if not (np.isfinite(values).all() and np.isfinite(expanded).all() and np.all(expanded >= 0)):
        return [*found, "values and uncertainties must be finite, and uncertainties not negative"]
    if len(columns) != n or any(len(column) != n or any(len(cell) != 1 for cell in column) for column in columns):
        return [*found, f"the covariance is not {n} by {n}"]
    return found + _faults_of_covariance(np.array(columns)[:, :, 0].T, expanded)


def _faults_of_covariance(matrix: Array, expanded: Array) -> list[str]:
    """Symmetry, signs, and agreement with the expanded uncertainties to rounding."""
    if not np.isfinite(matrix).all() or np.any(np.diagonal(matrix) < 0):
        return ["a variance is negative or not finite"]
    sd = np.sqrt(np.diagonal(matrix))
    size = np.outer(sd, sd)
    if np.any(np.abs(matrix - matrix.T) > 1e-9 * size):
        return ["the covariance is not symmetric"]
    if np.any(np.abs(matrix) > size * (1 + 1e-9)):
        return ["a covariance is larger than its variances allow"]
    if np.any(np.abs(FACTOR * sd - expanded) > 1e-9 * expanded):
        return ["the expanded uncertainties are not k times the roots of the variances"]
    return []


def attached(root: Element) -> dict[str, Any]:
    """Return the JSON document that is attached to a certificate. Raises `CertificateRefused` where there is none that
    can be read.
    """
    one = root.find("dcc:document", SPACES)
    name = None if one is None else one.findtext("dcc:fileName", None, SPACES)
    if one is None or name != ATTACHED:
        raise CertificateRefused(f"there is no attached {ATTACHED}")
    try:
        found = json.loads(base64.b64decode(one.findtext("dcc:dataBase64", "", SPACES), validate=True))
        return {**found, "triads": list(found["triads"])}
    except (binascii.Error, ValueError, KeyError, TypeError) as error:
        raise CertificateRefused(f"the attached {ATTACHED} cannot be read: {error}") from error


def _faults_of_attachment(root: Element, lists: list[Element]) -> list[str]:
    """The attached JSON has the same numbers, to the last digit."""
    try:
        triads = attached(root)["triads"]
        of_json = [[repr(row["value"]) for row in triad["coefficients"]] for triad in triads]
    except CertificateRefused as error:
        return [str(error)]
    except (KeyError, TypeError) as error:
        return [f"the attached {ATTACHED} lacks {error}"]
    of_xml = [_words(one, "si:valueXMLList") for one in lists]
    return [] if of_json == of_xml else [f"the coefficients are not those of the attached {ATTACHED}"]
