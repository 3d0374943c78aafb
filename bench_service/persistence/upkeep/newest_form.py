"""The newest form of an empty SQLite database as SQL, so that a first start runs no migration and loads no Alembic.

The file is made from the migrations by `make newest-form`, and a test compares it with them. Where it is of another
revision than the newest migration it counts for nothing, and the migrations run.
"""

import re
import secrets
from pathlib import Path
from typing import Any

from sqlalchemy import Connection, text

FILE = Path(__file__).resolve().parents[3] / "migrations" / "newest_form.sql"
REVISION = "-- revision "
END = ";\n\n"
SECRET = "{a new secret}"
"""Place of a secret of 64 hexadecimal digits that each database draws for itself."""
_A_SECRET = re.compile(r"[0-9a-f]{64}")
_OBJECTS = (
    "SELECT sql FROM sqlite_master WHERE sql IS NOT NULL AND name NOT LIKE 'sqlite^_%' ESCAPE '^' "
    "ORDER BY CASE type WHEN 'table' THEN 0 ELSE 1 END, name"
)
_TABLES = "SELECT name FROM sqlite_master WHERE type = 'table' AND name NOT LIKE 'sqlite^_%' ESCAPE '^' ORDER BY name"


def put_newest_form(connection: Connection, revision: str) -> bool:
    """Make all tables of `revision` in an empty SQLite database; False where the file does not have that revision."""
    if not FILE.is_file():
        return False
    head, _, script = FILE.read_text(encoding="utf-8").partition("\n")
    if head != REVISION + revision:
        return False
    for statement in script.strip().removesuffix(END.strip()).split(END):
        connection.exec_driver_sql(statement.strip().replace(SECRET, secrets.token_hex(32)))
    return True


def newest_form_of(connection: Connection, revision: str) -> str:
    """Return an SQLite database that the migrations have just made as SQL text: its tables, indexes and first rows."""
    parts = [str(sql) for (sql,) in connection.execute(text(_OBJECTS))]
    for (table,) in connection.execute(text(_TABLES)).all():
        rows = connection.execute(text(f'SELECT * FROM "{table}"')).all()
        parts += [f'INSERT INTO "{table}" VALUES ({", ".join(map(_literal, row))})' for row in rows]
    return "".join([f"{REVISION}{revision}\n", *(part + END for part in parts)])


def _literal(value: Any) -> str:
    """Write a value of a first row as SQL. Raises `TypeError` for a type that no first row has."""
    if isinstance(value, int):
        return str(int(value))
    if not isinstance(value, str):
        raise TypeError(f"a first row holds {value!r}: write how it is put into SQL here")
    kept = SECRET if _A_SECRET.fullmatch(value) else value.replace("'", "''")
    return f"'{kept}'"
