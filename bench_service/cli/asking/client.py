"""HTTP client for both ways: a server's address, or the same application in this process."""

import tempfile
from collections.abc import Generator, Sequence
from contextlib import contextmanager, nullcontext
from pathlib import Path
from typing import TYPE_CHECKING, Any
from urllib.parse import quote

from bench_service.cli.refusal import Away, Refused
from bench_service.settings import BadSettings, Settings

if TYPE_CHECKING:
    import httpx  # at run time where it is used: a server that starts needs no client

TIMEOUT_S = 600.0
NOT_NOW = (502, 503, 504)
"""Status codes of a service that is not ready, and of a proxy whose service is away."""
SHOWN = 120
"""Length to which an unexpected answer is cut when it is shown [characters]."""

RESULT = ("id", "verdict", "document")
"""Fields of a result that commands read."""


@contextmanager
def connect(settings: Settings, server: str | None, drive: bool) -> Generator["httpx.Client"]:
    """Open a client to `server`, or to an application in this process that is open as long as the block.

    `drive`: true where the embedded application is to run jobs, for which it must have the bench to itself. SIGTERM and
    SIGHUP then raise `KeyboardInterrupt` in the block, as Ctrl-C does.
    Raises `Refused` where no service answers a request made in the block.
    """
    import httpx

    try:
        with _client(settings, server, drive) as client:
            yield client
    except httpx.InvalidURL as error:
        raise Refused(f"--server {server}: {error}") from error
    except httpx.RequestError as error:
        raise _away(error) from error


def _token(settings: Settings) -> dict[str, str]:
    """Build the header with the service's token, where the settings have one. Raises `Refused`."""
    try:
        token = settings.token()
    except BadSettings as error:
        raise Refused(str(error)) from error
    return {} if token is None else {"Authorization": f"Bearer {token}"}


def _address(server: str) -> "httpx.URL":
    """Return the address of the service as a URL. Raises `Refused` for a host name that no resolver would take."""
    import httpx

    url = httpx.URL(server if "://" in server else f"http://{server}")
    try:
        url.host.encode("idna")
    except UnicodeError as error:
        raise Refused(f"--server {server}: {url.host!r} is not a host name") from error
    return url


@contextmanager
def _client(settings: Settings, server: str | None, drive: bool) -> Generator["httpx.Client"]:
    import httpx

    if server is not None:
        with httpx.Client(base_url=_address(server), timeout=TIMEOUT_S, headers=_token(settings)) as client:
            yield client
        return
    from bench_service.cli.processes.ending import ending_like_ctrl_c
    from bench_service.cli.processes.serving import (
        serving,  # a quarter of a second that a client of a server does not need
    )

    signals = ending_like_ctrl_c() if drive else nullcontext(lambda: None)
    with signals as ignore_signals, tempfile.TemporaryDirectory(prefix="bench-") as folder:
        socket_file = Path(folder) / "http"
        with (
            serving(settings, drive, socket_file),
            httpx.Client(
                base_url="http://embedded", transport=httpx.HTTPTransport(uds=str(socket_file)), timeout=TIMEOUT_S
            ) as client,
        ):
            try:
                yield client
            finally:
                ignore_signals()  # from here on the bench is made safe


def call(client: "httpx.Client", method: str, path: str, fields: Sequence[str], **options: Any) -> Any:
    """Return the JSON object of a good answer that has these fields. Raises `Refused` with the service's reason."""
    response = answer(client, method, path, **options)
    found = _json(response)
    if not isinstance(found, dict) or not all(name in found for name in fields):
        raise Refused(_no_service(response))
    return found


def answer(client: "httpx.Client", method: str, path: str, **options: Any) -> "httpx.Response":
    """Return a good answer, whatever it holds. Raises `Refused` with the service's reason, `Away` if it may return."""
    import httpx

    try:
        request = client.build_request(method, path, **options)
    except ValueError as error:  # a number or a letter that JSON cannot hold
        raise Refused(f"the request cannot be sent: {error}") from error
    try:
        response = client.send(request)
    except httpx.RequestError as error:
        raise _away(error) from error
    check(response)
    return response


def check(response: "httpx.Response") -> None:
    """Check that an answer is good. Raises `Refused` with the service's reason if it is an error or a web page."""
    if not response.is_success:
        response.read()
        raise (Away if response.status_code in NOT_NOW else Refused)(_sentence(response))
    if response.headers.get("content-type", "").startswith("text/html"):  # nothing that is asked for here is a page
        response.read()
        raise Refused(_no_service(response))


def segment(name: str) -> str:
    """Return a name quoted as one segment of a path, whatever is in it."""
    return quote(name, safe="")


def _away(error: "httpx.RequestError") -> Away:
    return Away(f"{error.request.url} does not answer: {str(error) or type(error).__name__}")


def _sentence(response: "httpx.Response") -> str:
    """Format a problem document as one sentence; of any other answer, its source and its first characters."""
    problem = _json(response)
    if isinstance(problem, dict):
        found = problem.get("errors")
        fields = [_field(one) for one in found if isinstance(one, dict)] if isinstance(found, list) else []
        words = "; ".join(filter(None, fields)) or problem.get("detail")
        if words and isinstance(words, str):
            return words
    return f"{response.url} answered {_beginning(response)}"


def _field(one: dict[str, Any]) -> str:
    given = f" = {one['value']!r}" if one.get("value") is not None else ""
    return ": ".join(filter(None, [f"{one.get('field', '')}{given}", str(one.get("message", ""))]))


def _no_service(response: "httpx.Response") -> str:
    return f"{response.url} is not a bench service: it answered {_beginning(response)}"


def _beginning(response: "httpx.Response") -> str:
    """Describe an answer by its status and first words, in one line."""
    text = " ".join(response.text.split())
    shown = text if len(text) <= SHOWN else f"{text[:SHOWN]}…"
    return f"{response.status_code} {response.reason_phrase}: {shown or 'nothing'}"


def _json(response: "httpx.Response") -> Any:
    """Parse the answer's body as JSON; None where it is no JSON."""
    try:
        return response.json()
    except (ValueError, RecursionError):
        return None
