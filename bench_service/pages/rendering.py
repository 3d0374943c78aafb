"""Rendering shared by all pages: templates, the filters in them, and the service behind the request."""

from pathlib import Path
from typing import Any

from fastapi import Request
from fastapi.templating import Jinja2Templates

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


def service_of(request: Request) -> BenchService:
    """Return the service that the application serves."""
    return request.app.state.service
