"""Structural rules of PDF/A-3 that a file can be held to without a validator, and the text of its pages.

They are rules of ISO 19005-3 that pypdf can read: no encryption (6.1.3), an output intent with an ICC profile (6.2.3),
fonts embedded (6.2.11.4), XMP that names part 3 (6.6.4), attached files with their relation, type and listed in /AF
(6.8), no action that runs something (6.5.1). They are not the whole standard.
"""

import io
from typing import Any
from xml.etree import ElementTree

from pypdf import PdfReader

RELATIONS = ("/Source", "/Data", "/Alternative", "/Supplement", "/EncryptedPayload", "/Unspecified")
PDFAID = "{http://www.aiim.org/pdfa/ns/id/}"


def text_of(data: bytes) -> str:
    return "\n".join(page.extract_text() for page in PdfReader(io.BytesIO(data)).pages)


def attached(data: bytes) -> dict[str, bytes]:
    return {name: contents[0] for name, contents in PdfReader(io.BytesIO(data)).attachments.items()}


def structural_faults(data: bytes) -> list[str]:
    """Rules that a file breaks; empty where none of those above is broken."""
    reader = PdfReader(io.BytesIO(data))
    root: Any = reader.trailer["/Root"]
    faults = ["encrypted"] if "/Encrypt" in reader.trailer else []
    if not data.startswith(b"%PDF-1.") or "/ID" not in reader.trailer:
        faults.append("header or file identifier")
    intents = [i.get_object() for i in root.get("/OutputIntents", [])]
    if [(i["/S"], "/DestOutputProfile" in i) for i in intents] != [("/GTS_PDFA1", True)]:
        faults.append("output intent")
    xmp = ElementTree.fromstring(root["/Metadata"].get_object().get_data().decode())
    part = [e.text for e in xmp.iter(f"{PDFAID}part")]
    if part != ["3"] or [e.text for e in xmp.iter(f"{PDFAID}conformance")] != ["B"]:
        faults.append(f"XMP names part {part}")
    if "/OpenAction" in root or "/AA" in root or b"/JavaScript" in data:
        faults.append("actions")
    listed = [f.get_object() for f in root.get("/AF", [])]
    named = root.get("/Names", {}).get("/EmbeddedFiles", {}).get("/Names", [])[1::2]
    if len(listed) != len(named):
        faults.append("attached files that are not in /AF")
    for file in listed:
        stream = file["/EF"]["/F"].get_object()
        if file.get("/AFRelationship") not in RELATIONS or "/Subtype" not in stream or "/UF" not in file:
            faults.append(f"attached file {file.get('/F')}")
    for page in reader.pages:
        for font in page["/Resources"].get("/Font", {}).values():
            kind = font.get_object()
            for one in kind.get("/DescendantFonts", [kind]):
                descriptor = one.get_object()["/FontDescriptor"].get_object()
                if not {"/FontFile", "/FontFile2", "/FontFile3"} & set(descriptor):
                    faults.append(f"font {descriptor['/FontName']} is not embedded")
    return faults
