"""A service on a loopback port of its own, for programs that ask over the network."""

import socket
from collections.abc import Generator
from contextlib import contextmanager
from pathlib import Path

from bench_service.cli.processes.serving import serving
from bench_service.settings import Settings


@contextmanager
def served(folder: Path, **settings: object) -> Generator[str]:
    """Serve a bench with its data in `folder`; yields the address."""
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        port: int = probe.getsockname()[1]
    given = {"database_url": f"sqlite:///{folder / 'bench.sqlite'}", "port": port, **settings}
    with serving(Settings.model_validate(given)):
        yield f"http://127.0.0.1:{port}"
