"""Routes that are loaded while the server already answers whether it lives; every other request waits for them.

To import all nouns and to build their routes takes as long as the rest of the start before it.
"""

import asyncio
from collections.abc import Callable
from concurrent.futures import Future

from starlette.types import ASGIApp, Receive, Scope, Send

from bench_service.background import in_background

LIVENESS = "/healthz"
"""Path of the one route that does not wait."""


class LateRoutes:
    """The loading of an application's routes: begun when it answers, waited for by its requests. For any thread."""

    def __init__(self, at_failure: Callable[[], object]) -> None:
        """Set up with `at_failure`, called in another thread where the routes cannot be loaded."""
        self._at_failure = at_failure
        self._loaded: Future[None] | None = None
        self.done = False
        """Whether the routes are there."""

    def begin(self, load: Callable[[], None]) -> None:
        """Load the routes in a thread of their own."""
        self._loaded = in_background("routes", load)
        self._loaded.add_done_callback(self._ended)

    def failure(self) -> BaseException | None:
        """Return the error that kept the routes from being loaded; None where they are there, or will be."""
        return self._loaded.exception() if self._loaded is not None and self._loaded.done() else None

    def require(self) -> None:
        """Wait for the routes. Raises the error that kept them from being loaded."""
        if self._loaded is not None:
            self._loaded.result()

    async def wait(self) -> None:
        """Wait for the routes in an event loop; raises as `require`."""
        if self._loaded is not None:
            await asyncio.shield(asyncio.wrap_future(self._loaded))  # who waits may be cancelled, the loading may not

    def _ended(self, loaded: "Future[None]") -> None:
        if loaded.exception() is None:
            self.done = True
        else:
            self._at_failure()


class WaitForRoutes:
    """ASGI middleware next to the router: requests wait for its routes."""

    def __init__(self, app: ASGIApp, late: LateRoutes) -> None:
        self._app = app
        self._late = late

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        if not self._late.done and scope["type"] == "http" and scope["path"] != LIVENESS:
            await self._late.wait()
        await self._app(scope, receive, send)
