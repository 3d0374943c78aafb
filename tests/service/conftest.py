"""A real service over a real HTTP client, on SQLite and on Postgres."""

import subprocess
import sys
from collections.abc import Generator, Iterator
from pathlib import Path

import pytest

from bench_service.cli.asking.client import connect
from bench_service.settings import Settings
from tests.service.client import Client


@pytest.fixture(scope="module", params=["sqlite", "postgres"])
def database_url(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> str:
    if request.param == "sqlite":
        return f"sqlite:///{tmp_path_factory.mktemp('service') / 'bench.sqlite'}"
    return request.getfixturevalue("new_postgres_database")()


@pytest.fixture(scope="module")
def client(database_url: str, tmp_path_factory: pytest.TempPathFactory) -> Generator[Client]:
    settings = Settings(database_url=database_url, device_folder=tmp_path_factory.mktemp("devices"))
    with connect(settings, None, drive=True) as http:
        yield Client(http)


@pytest.fixture(scope="module")
def sqlite_client(tmp_path_factory: pytest.TempPathFactory) -> Generator[Client]:
    """Where the database makes no difference."""
    url = f"sqlite:///{Path(tmp_path_factory.mktemp('service')) / 'bench.sqlite'}"
    with connect(Settings(database_url=url), None, drive=True) as http:
        yield Client(http)


@pytest.fixture
def worker() -> Iterator[subprocess.Popen[bytes]]:
    """A process that does nothing, until it is killed."""
    with subprocess.Popen([sys.executable, "-c", "import sys; sys.stdin.read()"], stdin=subprocess.PIPE) as made:
        yield made
        made.kill()
