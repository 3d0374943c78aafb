"""The HTTP server, in this thread or in one of its own."""

import errno
import socket
import sys
import threading
from collections.abc import Generator
from contextlib import ExitStack, contextmanager
from pathlib import Path

import uvicorn
from fastapi import FastAPI

from bench_service.api.access.identify import Proxies, behind_proxies
from bench_service.api.http.door import Door, may_listen
from bench_service.api.http.late_routes import LateRoutes
from bench_service.app import create_app, open_service
from bench_service.cli.processes.allocator import limit_allocator
from bench_service.cli.processes.connections import AT_ONCE, BoundedConnections, lengthen_queue, raise_descriptors
from bench_service.cli.processes.ending import calling_at_end
from bench_service.cli.processes.logs import set_up
from bench_service.cli.processes.private_files import protect
from bench_service.cli.refusal import Refused
from bench_service.collector import no_collection
from bench_service.persistence.access.peek import has_credentials
from bench_service.service import BenchService
from bench_service.settings import Settings
from bench_service.wall_clock import pause

EMBEDDED = "embedded"
"""Name that commands give to a service in their own process, which they reach over a socket file."""
SWITCH_S = 0.0005
"""Time after which a thread that computes gives way to another one [s]. A stop passes through several threads, and with
the interpreter's 5 ms each of these handovers may wait so long while a job runs at full speed."""
GRACE_S = 3
"""Time that open connections may take to end at shutdown [s]."""


class _Server(uvicorn.Server):
    """uvicorn's server, with a longer queue of connections, and exit code 0 after an orderly end on SIGTERM or SIGHUP.

    uvicorn itself does not know SIGHUP, and would raise SIGTERM again: no clean-up at exit would run.
    """

    def end(self) -> None:
        """Shut down in order; from any thread."""
        self.should_exit = True

    @contextmanager
    def capture_signals(self) -> Generator[None]:
        with super().capture_signals(), calling_at_end(self.end):
            yield

    async def startup(self, sockets: list[socket.socket] | None = None) -> None:
        await super().startup(sockets)
        lengthen_queue([each for server in self.servers for each in server.sockets])


@contextmanager
def ready(
    settings: Settings, drive: bool = True, socket_file: Path | None = None, level: str = "warning"
) -> Generator[uvicorn.Server]:
    """Open a server around a service, ready to run; the service is closed at the end, or when the server shuts down.

    `level`: from which on lines are logged, where the settings do not say.
    Raises `Refused` for an address that it may not listen on, `Misconfigured` for a token that cannot be used, and what
    `open_service` raises, before any thread or signal handler is there. Where the job engine does not start the server
    ends, and `NotDriving` is raised at the end of the block. A SIGTERM or SIGHUP that comes while the service is being
    opened ends the server once it runs; one that comes while it is closed, and its bench made safe, changes nothing.
    """
    servers: list[_Server] = []
    early = threading.Event()

    def end() -> None:
        early.set()
        for server in servers:
            server.end()

    with calling_at_end(end), _opened(settings, drive, socket_file, level) as (server, service, late):
        servers.append(server)
        if early.is_set():
            server.end()
        yield server
        _check_start(service, late)


@contextmanager
def _opened(
    settings: Settings, drive: bool, socket_file: Path | None, level: str
) -> Generator[tuple[_Server, BenchService, LateRoutes]]:
    set_up(settings, level)
    sys.setswitchinterval(SWITCH_S)
    protect(settings)
    limit_allocator()
    BoundedConnections.most = raise_descriptors()
    if socket_file is None:
        check_address(settings)
    rules = Door.of(settings) if socket_file is None else Door.of(settings, EMBEDDED)

    late = LateRoutes(lambda: server.end())
    with ExitStack() as closing:
        with no_collection():
            service = open_service(settings, closing, drive, apart=socket_file is None)
            max_bytes, proxies = int(settings.max_import_mb * 1e6), Proxies.of(settings)
            app = create_app(service, max_bytes, closing.close, rules, proxies, late)
            server = _server(settings, socket_file, app)
        service.at_failed_start(server.end)
        yield server, service, late


def _server(settings: Settings, socket_file: Path | None, app: FastAPI) -> _Server:
    config = uvicorn.Config(
        app,
        settings.host,
        settings.port,
        uds=None if socket_file is None else str(socket_file),
        log_config=None,
        access_log=settings.log_access,
        timeout_graceful_shutdown=GRACE_S,
        http=BoundedConnections,
        backlog=AT_ONCE,
        proxy_headers=False,  # ours are outside the application, and keep the socket's own address
    )
    config.app = behind_proxies(config.app, [config.forwarded_allow_ips, *settings.proxy_addresses])
    return _Server(config)


def _check_start(service: BenchService, late: LateRoutes) -> None:
    failure = service.failed_start() or late.failure()
    if failure is not None:
        raise failure


def check_address(settings: Settings) -> None:
    """Check the address of the server. Raises `Refused` if anyone could reach it, with the settings it needs."""
    if not may_listen(settings) and not has_credentials(settings.database_url):
        raise Refused(
            f"BENCH_HOST = {settings.host}: the service listens on an address other than a loopback one only with "
            "accounts (`bench user add`), or with a token that clients send with each request (`bench token add`, or "
            "one in the file BENCH_TOKEN_FILE), or where that address can be reached only through a loopback one "
            "(BENCH_PUBLISHED=loopback)"
        )


def check_port(settings: Settings) -> None:
    """Check port and address. Raises `Refused` with a hint where the port is taken, and as `check_address`."""
    check_address(settings)
    with socket.socket(socket.AF_INET, socket.SOCK_STREAM) as probe:
        probe.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        try:
            probe.bind((settings.host, settings.port))
        except OSError as error:
            why = "is taken" if error.errno == errno.EADDRINUSE else f"cannot be opened: {error.strerror}"
            raise Refused(
                f"port {settings.port} of {settings.host} {why}; "
                "choose others with PORT=…, BENCH_PORT=… and BENCH_HOST=…"
            ) from error


@contextmanager
def serving(settings: Settings, drive: bool = True, socket_file: Path | None = None) -> Generator[None]:
    """Run a server in a thread of its own, answering from the first line of the block, its job engine running.

    Raises as `ready`, but before the block is entered.
    """
    with _opened(settings, drive, socket_file, "warning") as (running, service, late):
        thread = threading.Thread(target=running.run, name="http")
        thread.start()
        try:
            while not running.started:
                if not thread.is_alive():
                    _check_start(service, late)
                    raise Refused("the service did not start; the lines above say why")
                pause(0.01)
            service.require_start()
            late.require()
            yield
        finally:
            running.should_exit = True
            thread.join()
