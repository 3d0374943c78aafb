"""The engine's own books on SQLite: its clock is right whatever the library's version."""

import sqlite3
from pathlib import Path

import pytest
import sqlalchemy as sa

from bench_service.persistence import engine_database
from bench_service.persistence.engine_database import unix_epoch
from bench_service.wall_clock import now


def test_the_clock_of_the_engines_tables_has_milliseconds(tmp_path: Path) -> None:
    """As DBOS writes it under Python 3.12 and newer, in a query and as the default of a column."""
    url, options = engine_database(f"sqlite:///{tmp_path / 'bench.sqlite'}", "sim")
    engine = sa.create_engine(url, **options)
    before = now().timestamp()
    with engine.begin() as connection:
        connection.execute(
            sa.text("CREATE TABLE moments (id INTEGER, at INTEGER NOT NULL DEFAULT (unixepoch('subsec') * 1000))")
        )
        for number in range(20):
            connection.execute(sa.text("INSERT INTO moments (id) VALUES (:number)"), {"number": number})
        moments = list(connection.scalars(sa.text("SELECT at FROM moments ORDER BY id")))
        asked = connection.scalar(sa.select(sa.cast(sa.func.unixepoch("subsec") * 1000, sa.BigInteger)))
    after = now().timestamp()
    engine.dispose()
    assert asked is not None
    for moment in (*moments, asked):  # a millisecond is lost where a product is cut to a whole number
        assert before * 1000 - 2 <= moment <= after * 1000 + 1
    assert moments == sorted(moments)


def test_our_function_is_that_of_newer_libraries() -> None:
    if sqlite3.sqlite_version_info < (3, 42, 0):
        pytest.skip(f"SQLite {sqlite3.sqlite_version} has no unixepoch('subsec') to compare with")
    connection = sqlite3.connect(":memory:")
    for _ in range(100):
        (theirs,) = connection.execute("SELECT unixepoch('subsec')").fetchone()
        assert unix_epoch("subsec") - theirs == pytest.approx(0.0, abs=1.0)
        assert type(theirs) is float
    connection.close()


def test_what_the_engine_does_not_ask_is_refused() -> None:
    with pytest.raises(ValueError, match="only 'subsec'"):
        unix_epoch("now")
