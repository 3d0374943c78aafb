"""The migration of starts that were a cron line without a year: each is one moment, or over."""

import json
from typing import Any

import sqlalchemy as sa

from bench_service.campaigns.stores import Stores
from bench_service.persistence import Database
from bench_service.wall_clock import now
from tests.storage.migrating import migrated

MADE, NEXT, LAST = "2026-11-30T12:00:00+00:00", "2027-02-03T20:30:00+00:00", "2026-12-01T20:30:00+00:00"
ONCE = {"cron": "30 20 3 2 *", "time_zone": "UTC", "once": True, "enabled": True, "next_at": None, "last_at": None}
NIGHTLY = {"cron": "0 1 * * *", "time_zone": "Europe/Kyiv", "once": False}
OFF = {"enabled": False}
CASES: dict[str, tuple[dict[str, Any], str | None, str | None]] = {
    "waits": ({"next_at": NEXT}, NEXT, NEXT),
    "was": ({"last_at": LAST, **OFF}, LAST, None),
    "was switched on again, for the next year": ({"next_at": NEXT, "last_at": LAST}, LAST, None),
    "off before its start": (OFF, NEXT, None),
    "off, on the clock of Kyiv": ({"time_zone": "Europe/Kyiv", **OFF}, "2027-02-03T18:30:00+00:00", None),
    "off, of an unknown zone": ({"time_zone": "Atlantis", **OFF}, MADE, None),
    "of another line": ({"cron": "*/5 1 * * *", **OFF}, MADE, None),
    "nightly": ({"next_at": NEXT, **NIGHTLY}, None, NEXT),
}
"""Schedule -> what it says of itself, then its moment and its next start after the migration."""


def insert(database: Database, name: str, said: dict[str, Any]) -> None:
    document = {"id": name, "campaign": "c", "unit": "U-1", "created_at": MADE, **ONCE, **said}
    columns = {one: document[one] for one in ("id", "campaign", "enabled", "created_at", "next_at", "last_at")}
    query = f"INSERT INTO schedules ({', '.join(columns)}, document) VALUES (:{', :'.join(columns)}, :document)"
    with database.write_connection() as connection:
        connection.execute(sa.text(query), {**columns, "document": json.dumps(document)})


def test_a_start_once_becomes_its_moment_and_one_that_was_is_over(stores: Stores, database: Database) -> None:
    migrated(database, "0022")
    for name, (said, _, _) in CASES.items():
        insert(database, name, said)
    migrated(database, "0023")
    found = {one.id: one for one in stores.campaigns.schedules().items}
    for name, (_, at, next_at) in CASES.items():
        one = found[name]
        assert [each and each.isoformat() for each in (one.at, one.next_at)] == [at, next_at], name
        assert one.enabled is (next_at is not None), name
        assert one.cron == (None if at else "0 1 * * *"), name
    assert {one.id for one in stores.campaigns.due_schedules(now().replace(year=2099))} == {"waits", "nightly"}
    migrated(database, "0022")
    with database.engine.connect() as connection:
        rows = connection.execute(sa.text("SELECT id, document FROM schedules")).all()
    back = {row.id: json.loads(row.document) if isinstance(row.document, str) else row.document for row in rows}
    assert {name for name, one in back.items() if one["once"]} == CASES.keys() - {"nightly"}
    assert back["waits"]["cron"] == ONCE["cron"]
    migrated(database, "0023")
