"""Scripts and style sheets of the pages: the service's, and those of the package that shows the API's document."""

import hashlib
from dataclasses import dataclass
from functools import cache
from importlib.resources import files

from fastapi import APIRouter, Request, Response

from bench_service.model.errors import NotFound
from bench_service.pages.caching import kept

router = APIRouter(include_in_schema=False)

MEDIA_TYPES = {"css": "text/css", "js": "text/javascript", "svg": "image/svg+xml"}
OWN = ("page.css", "act.js", "log_in.js", "log_out.js", "live.js", "reload.js", "choose.js", "docs.js", "icon.svg")
OF_PACKAGE = ("swagger-ui.css", "swagger-ui-bundle.js")
"""Names of the files that the package `fastapi-offline` carries."""


@dataclass(frozen=True)
class StaticFile:
    """A static file with its content and media type."""

    content: bytes
    media_type: str
    version: str


@cache
def static_file(name: str) -> StaticFile:
    """Find a file by its name. Raises `NotFound`."""
    if name in OWN:
        folder = files("bench_service.pages")
    elif name in OF_PACKAGE:
        folder = files("fastapi_offline")
    else:
        raise NotFound("file", name)
    content = (folder / "static" / name).read_bytes()
    return StaticFile(content, MEDIA_TYPES[name.rpartition(".")[2]], hashlib.sha256(content).hexdigest()[:16])


def asset(name: str) -> str:
    """Return the address of a file, with its version: a browser fetches it once."""
    return f"/static/{name}?v={static_file(name).version}"


@router.get("/static/{name}")
def read_static(name: str, request: Request) -> Response:
    """A script or a style sheet."""
    file = static_file(name)
    return kept(request, file.version, file.media_type, lambda: file.content)
