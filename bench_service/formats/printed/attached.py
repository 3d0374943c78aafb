"""Files that are attached to a PDF, read back by pypdf."""

import io
from collections.abc import Mapping

BEGINS = b"%PDF-"


class UnreadablePdf(Exception):
    """Raised where a file is no PDF that can be read; the message is fit for a person."""


def attached_files(data: bytes) -> Mapping[str, bytes]:
    """Return the files inside a PDF by name. Raises `UnreadablePdf`."""
    from pypdf import PdfReader
    from pypdf.errors import PyPdfError

    try:
        found = PdfReader(io.BytesIO(data)).attachments
        return {name: contents[0] for name, contents in found.items() if len(contents) == 1}
    except (PyPdfError, ValueError, KeyError, TypeError, AttributeError, RecursionError) as error:
        raise UnreadablePdf(f"the PDF cannot be read: {error}") from error
