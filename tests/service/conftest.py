"""A real service over a real HTTP client, on SQLite and on Postgres."""

import random
import subprocess
import sys
from collections.abc import Generator, Iterator
from pathlib import Path

import pytest

from bench_service.campaigns import service as campaign_service
from bench_service.cli.asking.client import connect
from bench_service.jobs import service as job_service
from bench_service.settings import Settings
from tests.service.client import Client


def pytest_generate_tests(metafunc: pytest.Metafunc) -> None:
    """Run a module's tests on each database, or on those that it names in `BACKENDS` with its reason."""
    if "database_kind" in metafunc.fixturenames:
        backends = getattr(metafunc.module, "BACKENDS", ("sqlite", "postgres"))
        metafunc.parametrize("database_kind", backends, indirect=True, scope="module")


@pytest.fixture(scope="module", autouse=True)
def repeatable_seeds(request: pytest.FixtureRequest) -> Generator[None]:
    """Draw seeds where a test names none from the module's own sequence: no verdict hangs on the day."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(job_service, "SEEDS", random.Random(f"jobs of {request.module.__name__}"))
        patch.setattr(campaign_service, "SEEDS", random.Random(f"runs of {request.module.__name__}"))
        yield


@pytest.fixture(scope="module")
def database_kind(request: pytest.FixtureRequest) -> str:
    """The kind of database that the module's service works on."""
    return request.param


@pytest.fixture(scope="module")
def database_url(database_kind: str, request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> str:
    if database_kind == "sqlite":
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
