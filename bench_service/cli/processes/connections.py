"""Limit on idle connections, so that they cannot keep a stop out: bench, database and files have descriptors reserved.

Where more connections come than there is room for, the oldest idle one is closed for each new one; one that has not
sent its request within `HEADERS_S` is closed anyway. A request that is at work is never cut.
"""

import asyncio
import logging
import resource
import socket
from contextlib import suppress

from uvicorn.protocols.http.httptools_impl import HttpToolsProtocol

RESERVED = 256
"""Number of descriptors that are reserved, so that no connection gets them."""
LEAST = 64
"""Smallest limit on connections, whatever the number of descriptors."""
WANTED = 65_536
"""Number of descriptors that the process asks the system for, up to its hard limit."""
HEADERS_S = 20.0
"""Time within which a connection's first request must have come, up to its body [s]."""
AT_ONCE = 64
"""Number of connections that are accepted before the first of them is served."""
QUEUE = 2048
"""Number of connections that may wait in the listening queue meanwhile."""

log = logging.getLogger(__name__)


class BoundedConnections(HttpToolsProtocol):
    """uvicorn's HTTP protocol with a limit on idle connections, of which the oldest are closed."""

    most = WANTED
    """Largest number of connections at once."""
    _late: asyncio.TimerHandle | None = None

    def connection_made(self, transport: asyncio.Transport) -> None:  # type: ignore[override]
        super().connection_made(transport)
        self._late = self.loop.call_later(HEADERS_S, self._end_if_idle)
        _in_order[self] = None
        if len(_in_order) > self.most:
            _end_oldest_idle()

    def connection_lost(self, exc: Exception | None) -> None:
        super().connection_lost(exc)
        _in_order.pop(self, None)
        if self._late is not None:
            self._late.cancel()

    @property
    def _begun(self) -> bool:
        """Return whether a first request has come, as far as its body."""
        return getattr(self, "cycle", None) is not None

    @property
    def idle(self) -> bool:
        """True where the connection has no request at work now."""
        return not self._begun or self.cycle.response_complete

    def _end_if_idle(self) -> None:
        if not self._begun and not self.transport.is_closing():
            self.transport.abort()


_in_order: dict[BoundedConnections, None] = {}
"""Open connections of this process, oldest first."""


def _end_oldest_idle() -> None:
    for connection in _in_order:
        if connection.idle and not connection.transport.is_closing():
            _in_order.pop(connection)
            connection.transport.abort()
            return


def raise_descriptors() -> int:
    """Raise the limit of descriptors as far as the system allows; return how many connections that leaves room for."""
    soft, hard = resource.getrlimit(resource.RLIMIT_NOFILE)
    wanted = WANTED if hard == resource.RLIM_INFINITY else min(WANTED, hard)
    if soft != resource.RLIM_INFINITY and soft < wanted:
        with suppress(OSError, ValueError):
            resource.setrlimit(resource.RLIMIT_NOFILE, (wanted, hard))
            soft = wanted
    return WANTED if soft == resource.RLIM_INFINITY else max(LEAST, soft - RESERVED)


def lengthen_queue(sockets: list[socket.socket]) -> None:
    """Let more connections wait in the sockets' queues than are accepted at once, so that none is refused while the
    oldest are closed.
    """
    for listening in sockets:
        with suppress(OSError), socket.socket(fileno=socket.dup(listening.fileno())) as same:
            same.listen(QUEUE)
