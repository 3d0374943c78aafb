"""Identification of each request, from memory alone: by token, by a trusted proxy's header, or by the log-in's cookie.

Nothing here waits for the database: see `bench_service.access.book`. A credential that is not known is looked for once
more, for half a second at the most, since another process may have made it a moment ago.
"""

import asyncio
import getpass
import hmac
from collections.abc import Sequence
from dataclasses import dataclass, replace
from ipaddress import IPv4Network, IPv6Network, ip_address, ip_network
from typing import Any

from starlette.datastructures import Headers
from starlette.requests import cookie_parser
from starlette.types import ASGIApp, Receive, Scope, Send
from uvicorn.middleware.proxy_headers import ProxyHeadersMiddleware

from bench_service.access.book import AccessBook
from bench_service.access.credentials import csrf_of, digest_of
from bench_service.access.identity import Identity, Proof
from bench_service.access.roles import Role
from bench_service.access.service import SERVICE_TOKEN
from bench_service.api.http.door import Door, Refusal
from bench_service.settings import Settings
from bench_service.wall_clock import now

COOKIE, SECURE_COOKIE = "bench_session", "__Host-bench_session"
"""Names of the log-in's cookie, over HTTP and over HTTPS; a browser takes the second over HTTPS only."""
CSRF_HEADER = "X-CSRF-Token"
LOOK_AGAIN_S = 0.5
"""Longest time that a request with an unknown credential waits for another look at the database [s]."""
PEER = "bench.peer"
"""Key of the request's scope: the address of the socket, before a proxy's word about it is taken."""
FOUND = "bench.access"
"""Key of the request's scope: what is known of its sender."""


@dataclass(frozen=True)
class Found:
    """Identification of a request: its identity, or the reason why it has none, and whether it comes from this host."""

    local: bool
    """True where the request comes from this host."""
    identity: Identity | None = None
    stopper: Identity | None = None
    """Somebody whose session has ended by itself, and who still may stop a bench."""
    refusal: Refusal | None = None
    """The reason why there is no identity."""
    claims: bool = False
    """True where the service has no accounts, so that the name counts that a client gives itself."""

    @property
    def proven_name(self) -> str | None:
        """Name that the request has proved, also by a session that has ended; None where it proved none."""
        identity = self.identity or self.stopper
        return None if identity is None else identity.proven_name

    def name(self, claimed: str | None) -> str | None:
        """Return the name under which a request acts: the proved one; where nobody logs in, the one that a client gives
        itself. None: neither is there.
        """
        return self.proven_name or (claimed if self.claims else None)


@dataclass(frozen=True)
class Proxies:
    """Rule that says which addresses are proxies that authenticate people, and the header in which they name them."""

    header: str | None = None
    networks: tuple[IPv4Network | IPv6Network, ...] = ()

    @classmethod
    def of(cls, settings: Settings) -> "Proxies":
        """Return the rule that the settings state."""
        return cls(settings.proxy_user_header, tuple(ip_network(one) for one in settings.proxy_addresses))

    def trusted(self, peer: str | None) -> bool:
        """Return whether a socket's address is one of the proxies."""
        try:
            address = ip_address(peer or "")
        except ValueError:
            return False
        return any(address.version == one.version and address in one for one in self.networks)


class Identification:
    """Rules by which the sender of a request is identified, from the accounts, tokens and sessions in memory."""

    def __init__(self, door: Door, book: AccessBook, proxies: Proxies) -> None:
        self._door = door
        self._book = book
        self._proxies = proxies

    def find(self, headers: Headers, client: str | None, peer: str | None) -> Found:
        """Identify a request. `client`: its source as a proxy on this host says; `peer`: its socket's address.

        A bearer token counts first, then the proxy's header, then the cookie, then the place that it comes from.
        """
        local = self._door.is_local(client)
        if headers.get("authorization", "").partition(" ")[0].lower() == "bearer":
            return self._by_token(headers, local, client)
        if self._proxies.header is not None and headers.getlist(self._proxies.header):
            return self._by_proxy(headers, local, peer)
        secret = cookie_of(headers)
        if secret is not None and self._book.log_in_on:
            return self._by_session(digest_of(secret), local)
        if client is None and peer is None:
            return Found(True, Identity(_owner(), Role.ADMIN, Proof.OWNER, proven=self._book.log_in_on))
        if local and not self._book.log_in_on:
            return Found(True, Identity("", Role.ADMIN, Proof.NONE, proven=False))
        return Found(local, refusal=self._nobody(local, client))

    def _nobody(self, local: bool, client: str | None) -> Refusal:
        """The refusal of a request that says nothing about its sender."""
        if self._book.log_in_on:
            text = (
                "log in first (POST /api/v1/session, or /log-in in a browser), or send a token as Authorization: Bearer"
            )
            return Refusal(401, "NotLoggedIn", text, client or "this host")
        text = "requests from an address other than a loopback one need a token, as Authorization: Bearer"
        return Refusal(401, "NoToken", text, client or "this host")

    def _by_token(self, headers: Headers, local: bool, client: str | None) -> Found:
        given = headers.get("authorization", "").partition(" ")[2].strip()
        service = self._door.token
        if service is not None and hmac.compare_digest(given.encode(), service.encode()):
            return Found(local, Identity(SERVICE_TOKEN, Role.ADMIN, Proof.TOKEN, proven=self._book.log_in_on))
        token = self._book.token(digest_of(given))
        if token is None or not token.valid(now()):
            why = "this token is not known, or was revoked" if token is None else "this token has expired"
            return Found(local, refusal=Refusal(401, "NoToken", f"{why}: `bench token add` makes one", client or ""))
        self._book.note_use(token=token.id)
        return Found(local, Identity(token.name, token.role, Proof.TOKEN, token.team, token.id))

    def _by_proxy(self, headers: Headers, local: bool, peer: str | None) -> Found:
        assert self._proxies.header is not None
        names = headers.getlist(self._proxies.header)
        if not self._proxies.trusted(peer) or len(names) != 1:
            text = f"{self._proxies.header} is taken from the addresses of BENCH_PROXY_ADDRESSES alone, once"
            return Found(local, refusal=Refusal(403, "UntrustedProxy", text, peer or "a socket file"))
        account = self._book.account(names[0].strip().lower())
        if account is None:
            text = "the proxy names a person without an account here: `bench user add NAME --no-password` makes one"
            return Found(local, refusal=Refusal(403, "NoAccount", text, names[0]))
        csrf = csrf_of(self._book.state.key, f"proxy {account.name}")
        return Found(local, Identity(account.name, account.role, Proof.PROXY, account.team, account.name, csrf))

    def _by_session(self, digest: str, local: bool) -> Found:
        session = self._book.session(digest)
        account = None if session is None else self._book.account(session.account)
        if session is None or account is None:
            text = "this session is not known, or was ended: log in again"
            return Found(local, refusal=Refusal(401, "NotLoggedIn", text, "an unknown session"))
        csrf = csrf_of(self._book.state.key, f"session {digest}")
        identity = Identity(account.name, account.role, Proof.SESSION, account.team, digest, csrf)
        if session.valid(now()):
            self._book.note_use(session=digest)
            return Found(local, identity)
        text = "this session has ended: log in again"
        stopper = identity if session.stops(now()) else None
        return Found(local, stopper=stopper, refusal=Refusal(401, "NotLoggedIn", text, account.name))

    def has_credential(self, headers: Headers) -> bool:
        """Return whether a request has a credential that may be found after accounts and tokens are read again."""
        by_proxy = self._proxies.header is not None and self._proxies.header in headers
        return by_proxy or "authorization" in headers or cookie_of(headers) is not None

    @property
    def log_in_on(self) -> bool:
        """True where people must log in, which is so once there is an account."""
        return self._book.log_in_on

    async def look_again(self) -> None:
        """Have accounts and tokens read from the database again, and wait for it for a short time at the most."""
        await asyncio.wait((asyncio.wrap_future(self._book.refreshed()),), timeout=LOOK_AGAIN_S)


class Identified:
    """ASGI middleware that identifies the sender of each request; the right is checked at the route."""

    def __init__(self, app: ASGIApp, rules: Identification) -> None:
        self._app = app
        self._rules = rules

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        if scope["type"] == "http":
            found = scope.get(FOUND) or await self._found(scope)  # there already, where a page asks for its reader
            scope[FOUND] = found
            scope.setdefault("state", {})["identity"] = found.identity  # for pages, as `request.state.identity`
        await self._app(scope, receive, send)

    async def _found(self, scope: Scope) -> Found:
        headers, client = Headers(scope=scope), _address(scope.get("client"))
        peer = _address(scope.get(PEER, scope.get("client")))
        found = self._rules.find(headers, client, peer)
        if found.identity is None and self._rules.has_credential(headers):
            await self._rules.look_again()
            found = self._rules.find(headers, client, peer)
        return replace(found, claims=not self._rules.log_in_on)


class PeerKept:
    """ASGI middleware that keeps the address of the socket, before a proxy's word about its client is taken."""

    def __init__(self, app: Any) -> None:
        self._app = app

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        if scope["type"] == "http":
            scope[PEER] = scope.get("client")
        await self._app(scope, receive, send)


def behind_proxies(app: Any, trusted: Sequence[str | list[str] | None]) -> Any:
    """Wrap an application so that trusted proxies say for whom they ask, and the socket's address is kept."""
    hosts = [host for one in trusted if one for host in (one.split(",") if isinstance(one, str) else one)]
    return PeerKept(ProxyHeadersMiddleware(app, trusted_hosts=hosts))


def found_of(scope: Scope) -> Found:
    """Return the identification of a request; an empty one for a request that was refused before."""
    return scope.get(FOUND) or Found(False)


def cookie_of(headers: Headers) -> str | None:
    """Return the secret in the log-in's cookie; None where there is none."""
    cookies = cookie_parser(headers.get("cookie", ""))
    return cookies.get(SECURE_COOKIE) or cookies.get(COOKIE)


def _address(pair: Any) -> str | None:
    return None if not pair else pair[0]


def _owner() -> str:
    """The user who runs this process, to whom the service's files belong."""
    try:
        return getpass.getuser()
    except (OSError, KeyError):
        return "owner of the files"
