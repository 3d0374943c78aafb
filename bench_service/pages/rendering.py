"""Rendering shared by all pages: templates, the filters in them, and the service behind the request."""

from pathlib import Path
from typing import Any

from fastapi import Request
from fastapi.templating import Jinja2Templates

from bench_service.access.identity import Identity, Proof
from bench_service.pages.static_files import asset
from bench_service.service import BenchService

templates = Jinja2Templates(Path(__file__).parent / "templates")


def number(value: Any) -> str:
    """Format a cell for a reader: six significant digits, a dash for what is absent."""
    if value is None:
        return "–"
    if isinstance(value, bool):
        return "yes" if value else "no"
    return f"{value:.6g}" if isinstance(value, float) else str(value)


templates.env.filters["number"] = number
templates.env.filters["asset"] = asset
templates.env.globals["who"] = lambda request: who(request)


def who(request: Request) -> dict[str, Any]:
    """Describe the reader of a page: name and role, whether people log in here, and what changes must repeat."""
    identity: Identity | None = getattr(request.state, "identity", None)
    log_in_on = service_of(request).access.book.log_in_on
    if identity is None:
        return {"name": None, "role": None, "csrf": "", "log_in_on": log_in_on, "session": False}
    session = identity.proof is Proof.SESSION
    name, role = identity.proven_name, identity.role.value
    return {"name": name, "role": role, "csrf": identity.csrf or "", "log_in_on": log_in_on, "session": session}


def service_of(request: Request) -> BenchService:
    """Return the service that the application serves."""
    return request.app.state.service
