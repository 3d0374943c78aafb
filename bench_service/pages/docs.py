"""API documentation as a page, from files of an installed package: it needs no other host."""

from fastapi import Request
from fastapi.responses import HTMLResponse, JSONResponse, RedirectResponse

from bench_service.pages.rendering import templates
from bench_service.routing import Routes

router = Routes(include_in_schema=False, default_response_class=HTMLResponse)

POLICY = (
    "default-src 'none'; script-src 'self'; style-src 'self' 'unsafe-inline'; img-src 'self' data:; "
    "connect-src 'self'; base-uri 'none'; form-action 'self'; frame-ancestors 'none'"
)
"""The package styles its elements in place and has its icons in its style sheet; scripts are from own files only.
The form is that of the stop."""


@router.get("/docs")
def docs(request: Request) -> HTMLResponse:
    """Return the HTML page of every operation of the API, to be read and tried."""
    return templates.TemplateResponse(request, "docs.html", headers={"Content-Security-Policy": POLICY})


@router.get("/openapi.json")
def openapi_document(request: Request) -> JSONResponse:
    """Return the OpenAPI document of the API as JSON."""
    return JSONResponse(request.app.openapi())


@router.get("/redoc")
def redoc() -> RedirectResponse:
    """Redirect from the older address of the same document."""
    return RedirectResponse("/docs", status_code=308)
