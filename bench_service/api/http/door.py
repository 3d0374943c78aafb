"""Access rules for requests: the host a request is sent to, the page it comes from, and the address it comes from.

Host: a page of another site can make its own name resolve to this address (DNS rebinding), and then reads and commands
as a page of this service; so the name in `Host` must be one of this service's. Origin and Sec-Fetch-Site: a browser
states from which site a request comes; a request from another site is refused. The one exception is a person who
follows a link: a top-level navigation that only reads. A request with neither header comes from a program: it is let
in here, and its sender is identified by `bench_service.api.access.identify`.
"""

import logging
import re
from dataclasses import dataclass
from ipaddress import IPv6Address, ip_address
from socket import getaddrinfo
from urllib.parse import unquote

from starlette.datastructures import Headers
from starlette.requests import Request
from starlette.types import ASGIApp, Receive, Scope, Send

from bench_service.api.http.errors import respond
from bench_service.model.errors import Misconfigured
from bench_service.settings import BadSettings, Settings
from bench_service.telemetry.redaction import names_token, without_tokens
from bench_service.wall_clock import monotonic_s

LOOPBACK_NAMES = ("localhost", "127.0.0.1", "[::1]")
ANY_ADDRESS = ("0.0.0.0", "::", "")
READING = ("GET", "HEAD")
QUIET_S = 60.0
"""Interval in which a reason to refuse is logged once [s], so that a page that retries does not fill the disk."""
_AUTHORITY = re.compile(r"(?P<name>\[[0-9a-f:.]+\]|[a-z0-9._-]+)(?::(?P<port>[0-9]{1,5}))?")
_ORIGIN = re.compile(r"(?P<scheme>https?)://(?P<authority>[^/]+)")
_DEFAULT_PORT = {"http": "80", "https": "443"}

log = logging.getLogger(__name__)


@dataclass(frozen=True)
class Door:
    """Access rules of one service: accepted hosts, the token, and whether every peer is local."""

    hosts: frozenset[str]
    """Names in `Host` that belong to this service; with a port only that port, without one any."""
    token: str | None = None
    """The token of `BENCH_TOKEN_FILE`, with which a program may do everything."""
    all_local: bool = False
    """True where the address is reached through a port of a loopback address only, so that all peers count as local."""

    @classmethod
    def of(cls, settings: Settings, *more_hosts: str) -> "Door":
        """Return the rules that the settings state. Raises `Misconfigured` for a token that cannot be used."""
        own = () if settings.host in ANY_ADDRESS else (_bracketed(settings.host),)
        try:
            token = settings.token()
        except BadSettings as error:
            raise Misconfigured(str(error)) from error
        hosts = frozenset(name.lower() for name in (*LOOPBACK_NAMES, *own, *settings.hosts, *more_hosts))
        return cls(hosts, token, settings.published == "loopback")

    def refusal(self, headers: Headers, method: str, query: str = "") -> "Refusal | None":
        """Return why a request is refused; None where it is let in. `query`: what follows its path."""
        hosts = headers.getlist("host")
        if len(hosts) != 1 or not self._ours(hosts[0]):
            text = "the host name in this request is not one of this service: BENCH_HOSTS lists further names"
            return Refusal(421, "ForeignHost", text, ", ".join(hosts) or "none")
        for origin in headers.getlist("origin"):
            if not _same_origin(origin, hosts[0]):
                return Refusal(
                    403, "ForeignOrigin", "a page of another site may not send requests to this service", origin
                )
        site = headers.get("sec-fetch-site", "none")
        if site not in ("same-origin", "none") and not _follows_link(headers, method):
            return Refusal(403, "ForeignSite", "a page of another site may not send requests to this service", site)
        if names_token(f"{query} {headers.get('referer', '')}"):
            text = "a token in an address stands in logs and histories: revoke it, and send it as Authorization: Bearer"
            return Refusal(400, "TokenInAddress", text, "a token")
        return None

    def is_local(self, peer: str | None) -> bool:
        """Return whether a request comes from this host. `peer`: its source address; None: a socket file."""
        return self.all_local or peer is None or is_loopback_address(peer)

    def _ours(self, host: str) -> bool:
        found = _AUTHORITY.fullmatch(host.lower())
        return found is not None and (found["name"] in self.hosts or found[0] in self.hosts)


@dataclass(frozen=True)
class Refusal:
    """Reason for which a request is refused: status code, kind and sentence."""

    status: int
    kind: str
    text: str
    given: str
    """Value that the request had instead of an allowed one, for the log."""


class Doorkeeper:
    """ASGI middleware that applies the access rules of `Door`: a refused request reaches no route, and its body is not
    read.
    """

    def __init__(self, app: ASGIApp, door: Door) -> None:
        self._app = app
        self._door = door
        self._logged_s: dict[str, float] = {}

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        if scope["type"] != "http":
            await self._app(scope, receive, send)
            return
        query = f"{scope['path']}?{unquote(scope['query_string'].decode('latin-1'))}"
        refusal = self._door.refusal(Headers(scope=scope), scope["method"], query)
        if refusal is None:
            await self._app(scope, receive, send)
            return
        self._log(refusal, scope)
        await respond(Request(scope), refusal.status, refusal.text, refusal.kind)(scope, receive, send)

    def _log(self, refusal: Refusal, scope: Scope) -> None:
        now_s = monotonic_s()
        if now_s - self._logged_s.get(refusal.kind, -QUIET_S) < QUIET_S:
            return
        self._logged_s[refusal.kind] = now_s
        given, path = refusal.given[:200], without_tokens(scope["path"])[:200]
        log.warning(
            "refused %s %s, %s: %s; further ones of this kind are not logged for a minute",
            scope["method"],
            path,
            refusal.kind,
            given,
        )


def may_listen(settings: Settings) -> bool:
    """Return whether the settings alone let a service listen: at a loopback address, with a token file or `published`.

    False is no refusal yet: accounts and tokens in the database let it listen too, which the caller looks for.
    """
    return is_loopback(settings.host) or settings.token_file is not None or settings.published is not None


def is_loopback(host: str) -> bool:
    """Return whether a name or an address is this host's own, whatever it resolves to."""
    if host in ANY_ADDRESS:
        return False
    try:
        found = getaddrinfo(host, None)
    except OSError:
        return False
    return bool(found) and all(is_loopback_address(str(address[4][0])) for address in found)


def is_loopback_address(text: str) -> bool:
    """Return whether a text is a loopback address of this host; false for a text that is no address."""
    try:
        address = ip_address(text)
    except ValueError:
        return False
    if isinstance(address, IPv6Address) and address.ipv4_mapped is not None:
        address = address.ipv4_mapped
    return address.is_loopback


def _same_origin(origin: str, host: str) -> bool:
    """Return whether a page is this service's own: its scheme may differ where a proxy ends TLS."""
    found = _ORIGIN.fullmatch(origin.lower())
    if found is None:
        return False
    default = _DEFAULT_PORT[found["scheme"]]
    pairs = [_AUTHORITY.fullmatch(text.lower()) for text in (found["authority"], host)]
    names = [(pair["name"], pair["port"] or default) for pair in pairs if pair is not None]
    return len(names) == 2 and names[0] == names[1]


def _follows_link(headers: Headers, method: str) -> bool:
    """Return whether the request is a link from another site that a person follows in a top-level window."""
    top_level = (headers.get("sec-fetch-mode"), headers.get("sec-fetch-dest")) == ("navigate", "document")
    return top_level and method in READING


def _bracketed(host: str) -> str:
    """Format an address as `Host` has it."""
    return f"[{host}]" if ":" in host else host
