"""Answers that are printed reports: PDF, made a few at a time."""

from fastapi import Response

from bench_service.api.http.errors import binary
from bench_service.evidence.admission import Turns

PRINTED = Turns("printed reports", at_once=1, waiting=8)
"""Printed reports: one is made at a time, each takes a second or a few."""
PDF: dict[int | str, dict[str, object]] = {
    200: {"description": "The report as PDF/A-3, with its data attached", "content": binary("application/pdf")}
}


def printed(data: bytes, name: str) -> Response:
    """Return the response with a PDF that a browser shows, and saves under a name."""
    headers = {"Content-Disposition": f'inline; filename="{name}"', "Cache-Control": "no-cache"}
    return Response(data, media_type="application/pdf", headers=headers)
