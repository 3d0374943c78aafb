"""Route of the log-in page."""

import re

from fastapi import Request
from fastapi.responses import HTMLResponse

from bench_service.pages.rendering import templates
from bench_service.routing import Routes

router = Routes(include_in_schema=False, default_response_class=HTMLResponse)
_OWN_PATH = re.compile(r"/(?![/\\])[^\x00-\x1f\\]*")


def own_path(given: str) -> str:
    """Return a path of this service to continue with after the log-in; the first page for anything else."""
    return given if len(given) <= 2000 and _OWN_PATH.fullmatch(given) else "/"


@router.get("/log-in")
def log_in_page(request: Request, next: str = "/") -> HTMLResponse:  # noqa: A002  the name in the address
    """Return the HTML page of the log-in; after it the browser goes to `next`, the page that was wanted."""
    headers = {"Cache-Control": "no-store"}
    return templates.TemplateResponse(request, "log_in.html", {"next": own_path(next)}, headers=headers)
