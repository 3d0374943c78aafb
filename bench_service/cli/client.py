"""One client for both ways: a server's address, or the same application in this process."""

import tempfile
from collections.abc import Generator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any
from urllib.parse import quote

from bench_service.cli.refusal import Refused
from bench_service.settings import Settings

if TYPE_CHECKING:
    import httpx  # at run time where it is used: a server that starts needs no client

TIMEOUT_S = 600.0


@contextmanager
def connect(settings: Settings, server: str | None, drive: bool) -> Generator["httpx.Client"]:
    """A client to `server`, or to an application in this process that lives as long as the block.

    `drive`: whether the embedded application is to run jobs, for which it must have the bench to itself.
    Raises `Refused` where nobody answers, whatever in the block asks.
    """
    import httpx

    try:
        with _client(settings, server, drive) as client:
            yield client
    except httpx.InvalidURL as error:
        raise Refused(f"--server {server}: {error}") from error
    except httpx.RequestError as error:
        raise Refused(f"{error.request.url} does not answer: {error}") from error


@contextmanager
def _client(settings: Settings, server: str | None, drive: bool) -> Generator["httpx.Client"]:
    import httpx

    if server is not None:
        with httpx.Client(base_url=server, timeout=TIMEOUT_S) as client:
            yield client
        return
    from bench_service.cli.serving import serving  # a quarter of a second that a client of a server does not need

    with tempfile.TemporaryDirectory(prefix="bench-") as folder:
        socket_file = Path(folder) / "http"
        with (
            serving(settings, drive, socket_file),
            httpx.Client(
                base_url="http://embedded", transport=httpx.HTTPTransport(uds=str(socket_file)), timeout=TIMEOUT_S
            ) as client,
        ):
            yield client


def call(client: "httpx.Client", method: str, path: str, **options: Any) -> Any:
    """The JSON of a good answer. Raises `Refused` with what the service said."""
    return answer(client, method, path, **options).json()


def answer(client: "httpx.Client", method: str, path: str, **options: Any) -> "httpx.Response":
    """A good answer, whatever is in it. Raises `Refused` with what the service said."""
    response = client.request(method, path, **options)
    if not response.is_success:
        raise Refused(sentence(response))
    return response


def segment(name: str) -> str:
    """A name as one segment of a path, whatever is in it."""
    return quote(name, safe="")


def sentence(response: "httpx.Response") -> str:
    """A problem document in words."""
    try:
        problem = response.json()
    except ValueError:
        return f"{response.status_code}: {response.text[:200]}"
    fields = [f"{e['field']} = {e['value']!r}: {e['message']}" for e in problem.get("errors", [])]
    return "; ".join(fields) or problem.get("detail", response.text[:200])
