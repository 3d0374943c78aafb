"""The pages' way to the public API where no script runs: the application asks itself, as the person who asked it."""

from typing import TYPE_CHECKING, Any

from fastapi import Request
from starlette.types import Receive, Scope, Send

if TYPE_CHECKING:
    import httpx

KEPT = ("host", "origin", "referer", "sec-fetch-site", "sec-fetch-mode", "sec-fetch-dest", "cookie", "authorization")
"""Headers of the person's own request by which the API decides who asks, and from where."""
TIMEOUT_S = 20.0
SENDER = "bench.access"
"""Key of a request's scope under which the API keeps what it knows of the sender; no client can set it."""


async def ask(request: Request, method: str, path: str, document: dict[str, Any] | None = None) -> "httpx.Response":
    """Send a request to this service's own API with the person's own headers; the answer is the API's."""
    import httpx  # at run time where it is used: a server that starts needs no client

    headers = {name: value for name in KEPT if (value := request.headers.get(name)) is not None}
    client = (request.client.host, request.client.port) if request.client else ("127.0.0.1", 0)

    async def as_the_same_sender(scope: Scope, receive: Receive, send: Send) -> None:
        if SENDER in request.scope:  # what is known of the person already, also by a proxy's header
            scope[SENDER] = request.scope[SENDER]
        await request.app(scope, receive, send)

    transport = httpx.ASGITransport(app=as_the_same_sender, client=client)
    base = f"{request.url.scheme}://{request.headers.get('host', 'localhost')}"
    async with httpx.AsyncClient(transport=transport, base_url=base, timeout=TIMEOUT_S) as http:
        return await http.request(method, path, json=document, headers=headers)
