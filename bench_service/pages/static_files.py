"""Scripts and style sheets of the pages: the service's, and those of the packages that carry libraries for browsers.

Scripts import one another by relative addresses, so they stand under an address with the version of them all: a browser
fetches each once, and never mixes those of two versions.
"""

import hashlib
from dataclasses import dataclass
from functools import cache
from importlib.resources import files

from fastapi import Request, Response

from bench_service.model.errors import NotFound
from bench_service.pages.caching import FOR_GOOD, kept
from bench_service.routing import Routes

router = Routes(include_in_schema=False)

MEDIA_TYPES = {"css": "text/css", "js": "text/javascript", "svg": "image/svg+xml"}
OF_PACKAGE = {
    "swagger-ui.css": ("fastapi_offline", "static"),
    "swagger-ui-bundle.js": ("fastapi_offline", "static"),
    "uplot.iife.min.js": ("youplot", "vendor"),
    "uplot.min.css": ("youplot", "vendor"),
}
"""Files of installed packages, with package and folder: the API's document, and the charts of the pages."""


@dataclass(frozen=True)
class StaticFile:
    """A static file with its content, media type and version (a hash)."""

    content: bytes
    media_type: str
    version: str


@cache
def own() -> frozenset[str]:
    """Return the names of the service's own static files."""
    folder = files("bench_service.pages") / "static"
    return frozenset(file.name for file in folder.iterdir() if file.name.rpartition(".")[2] in MEDIA_TYPES)


@cache
def static_file(name: str) -> StaticFile:
    """Return the static file of that name, own or of a package. Raises `NotFound`."""
    if name in own():
        place = files("bench_service.pages") / "static"
    elif name in OF_PACKAGE:
        package, folder = OF_PACKAGE[name]
        place = files(package) / folder
    else:
        raise NotFound("file", name)
    content = (place / name).read_bytes()
    return StaticFile(content, MEDIA_TYPES[name.rpartition(".")[2]], hashlib.sha256(content).hexdigest()[:16])


@cache
def release() -> str:
    """Return the version of all own scripts and style sheets together, a hash of their contents."""
    known = "".join(name + static_file(name).version for name in sorted(own()))
    return hashlib.sha256(known.encode()).hexdigest()[:16]


def asset(name: str) -> str:
    """Return the address of a file, with its version: a browser fetches it once."""
    return f"/static/{name}?v={static_file(name).version}"


def module(name: str) -> str:
    """Return the address of a script that imports others: the version is a part of the path, and so theirs too."""
    return f"/static/{release()}/{name}?v={static_file(name).version}"


@router.get("/static/{name}")
def read_static(name: str, request: Request) -> Response:
    """Return a script or a style sheet by its name. Raises `NotFound`."""
    file = static_file(name)
    return kept(request, file.version, file.media_type, lambda: file.content)


@router.get("/static/{version}/{name}")
def read_static_of_release(version: str, name: str, request: Request) -> Response:
    """Return a script or a style sheet under the address of a release; of another release the browser does not keep it.
    Raises `NotFound`.
    """
    file = static_file(name)
    answer = kept(request, file.version, file.media_type, lambda: file.content)
    if version == release():
        answer.headers["Cache-Control"] = FOR_GOOD
    return answer
