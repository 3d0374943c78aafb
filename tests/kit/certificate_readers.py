"""Readers of a certificate besides the product: a second verifier, its numbers by the XML alone, the schema's files."""

from typing import Any

import xmlsec
from lxml import etree

from bench_service.formats.certificate.document import SPACES
from bench_service.formats.certificate.signature import KeyPair
from tests.shared_data import SHARED_DATA

SCHEMA = SHARED_DATA / "dcc"


def by_xmlsec(data: bytes, pair: KeyPair) -> None:
    """Verify by the other implementation. Raises `xmlsec.Error` where the signature is not valid."""
    context = xmlsec.SignatureContext()
    context.key = xmlsec.Key.from_memory(pair.certificate, xmlsec.constants.KeyDataFormatCertPem)
    context.verify(xmlsec.tree.find_node(etree.fromstring(data), "Signature"))


def numbers_of(root: Any) -> list[tuple[list[str], list[list[float]]]]:
    """Coefficients, as their digits stand there, and columns of the covariance, of each triad."""
    found: list[tuple[list[str], list[list[float]]]] = []
    for one in root.findall(".//si:realListXMLList", SPACES):
        columns = one.findall(".//si:columnXMLList", SPACES)
        cells = [[float(c.text or "nan") for c in column.findall("*/si:valueXMLList", SPACES)] for column in columns]
        found.append((one.findtext("si:valueXMLList", "", SPACES).split(), cells))
    return found
