"""The audit trail as a chain, on both databases: any change shows, and a closed stretch joins what is around it."""

import hashlib
import json
from concurrent.futures import ThreadPoolExecutor
from datetime import timedelta

import pytest
import sqlalchemy as sa

from bench_service.model.errors import IllegalTransition
from bench_service.persistence import Database, open_stores
from bench_service.persistence.telemetry import audit_store
from bench_service.persistence.telemetry.audit_store import SqlAuditTrail
from bench_service.telemetry.audit import AuditEntry
from bench_service.telemetry.audit_retention import AuditRetention
from bench_service.wall_clock import new_id, now

BEGUN = now() - timedelta(days=30)


@pytest.fixture
def database(database_url: str):
    _, opened = open_stores(database_url)
    yield opened
    opened.dispose()


@pytest.fixture
def trail(database: Database) -> SqlAuditTrail:
    return SqlAuditTrail(database)


def entry(number: int, **detail: object) -> AuditEntry:
    at = BEGUN + timedelta(days=number)
    return AuditEntry(new_id(), at, "ada", "submit", f"/jobs/{number}", "202", {"n": number, **detail})


def fill(trail: SqlAuditTrail, count: int) -> list[AuditEntry]:
    made = [entry(n, text="größe\n", value=0.1 + n) for n in range(count)]
    for one in made:
        trail.add(one)
    return made


def execute(database: Database, text: str) -> None:
    with database.write_connection() as connection:
        connection.execute(sa.text(text))


def test_a_trail_that_nobody_touched_is_whole(trail: SqlAuditTrail) -> None:
    assert trail.verify().whole
    made = fill(trail, 7)
    report = trail.verify()
    assert (report.whole, report.entries, report.sequence, report.faults) == (True, 7, 7, ())
    assert [one.id for one in trail.list().items] == [one.id for one in reversed(made)]


def test_the_digest_is_the_one_of_the_published_formula(database: Database, trail: SqlAuditTrail) -> None:
    """Computed anew from the rows, as somebody with a copy of the database would."""
    fill(trail, 3)
    digest = "0" * 64
    with database.read() as session:
        query = sa.text("SELECT sequence, id, who, action, target, outcome, CAST(detail AS TEXT) FROM audit ORDER BY 1")
        for n, (sequence, id_, who, action, target, outcome, detail) in enumerate(session.execute(query)):
            at = (BEGUN + timedelta(days=n)).isoformat(timespec="microseconds")
            line = json.dumps([sequence, id_, at, who, action, target, outcome, detail])
            digest = hashlib.sha256(f"{digest}\n{line}".encode()).hexdigest()
    assert trail.verify().digest == digest


@pytest.mark.parametrize(
    ("change", "said"),
    [
        ("UPDATE audit SET who = 'bo' WHERE sequence = 3", "entry 3"),
        ("UPDATE audit SET detail = '{\"n\": 9}' WHERE sequence = 3", "entry 3"),
        ("UPDATE audit SET outcome = '200' WHERE sequence = 5", "entry 5"),
        ("UPDATE audit SET digest = (SELECT digest FROM audit WHERE sequence = 1) WHERE sequence = 2", "entry 2"),
        ("DELETE FROM audit WHERE sequence = 4", "entry 4 missing"),
        ("DELETE FROM audit WHERE sequence < 3", "entries 1 … 2 missing"),
        ("UPDATE audit SET sequence = NULL WHERE sequence = 5", "no place in the chain"),
        ("UPDATE audit SET sequence = 0 WHERE sequence = 5", "no place in the chain"),
    ],
)
def test_any_change_shows(database: Database, trail: SqlAuditTrail, change: str, said: str) -> None:
    fill(trail, 5)
    execute(database, change)
    report = trail.verify()
    assert not report.whole
    assert said in " ".join(report.faults), report.faults


def test_an_entry_that_was_cut_off_the_end_shows_by_a_noted_digest(database: Database, trail: SqlAuditTrail) -> None:
    fill(trail, 5)
    noted = trail.verify().digest
    trail.add(entry(6))
    assert trail.verify(noted).whole, "it goes on"
    execute(database, "DELETE FROM audit WHERE sequence > 4")
    assert trail.verify().whole, "without the digest nothing is missing"
    report = trail.verify(noted)
    assert not report.whole
    assert noted in report.faults[0]


def test_a_closed_stretch_leaves_a_checkpoint_that_joins_the_chain(
    database: Database, trail: SqlAuditTrail, monkeypatch: pytest.MonkeyPatch
) -> None:
    fill(trail, 10)
    monkeypatch.setattr(audit_store, "STRETCH", 4)
    noted = trail.verify().digest
    assert trail.close(BEGUN, "ada", now()) == ()
    closed = trail.close(BEGUN + timedelta(days=6), "ada", now())
    assert [(one.first, one.last) for one in closed] == [(1, 4), (5, 6)]
    assert (closed[0].first_at, closed[1].last_at) == (BEGUN, BEGUN + timedelta(days=5))
    report = trail.verify(noted)
    assert (report.whole, report.entries, report.sequence, len(report.checkpoints)) == (True, 4, 10, 2)
    trail.add(entry(11))
    assert trail.verify(noted).whole
    assert trail.verify(closed[0].digest).whole, "a digest of what is gone is in its checkpoint"
    trail.close(now(), "ada", now())
    assert trail.verify().entries == 0
    trail.add(entry(12))
    report = trail.verify(noted)
    assert (report.whole, report.sequence) == (True, 12)
    execute(database, "UPDATE audit_checkpoints SET digest = before WHERE first = 5")
    assert "checkpoint" in trail.verify().faults[0]


def test_a_broken_stretch_is_not_removed(database: Database, trail: SqlAuditTrail) -> None:
    fill(trail, 5)
    execute(database, "UPDATE audit SET who = 'bo' WHERE sequence = 2")
    with pytest.raises(IllegalTransition, match="entry 2"):
        trail.close(now(), "ada", now())
    assert trail.verify().entries == 5


def test_entries_that_come_at_once_form_one_chain(trail: SqlAuditTrail) -> None:
    with ThreadPoolExecutor(8) as pool:
        list(pool.map(lambda n: trail.add(entry(n)), range(40)))
    report = trail.verify()
    assert (report.whole, report.entries) == (True, 40)


def test_the_trail_of_an_older_service_is_chained_as_it_stands(empty_database_url: str) -> None:
    from alembic import command
    from alembic.config import Config

    from bench_service.persistence.database import connect
    from bench_service.persistence.migration import SCRIPTS

    database, config = connect(empty_database_url), Config()
    config.set_main_option("script_location", str(SCRIPTS))
    with database.write_connection() as connection:
        config.attributes["connection"] = connection
        command.upgrade(config, "0007")
        columns = "id, at, who, action, target, outcome, detail"
        insert = f"INSERT INTO audit ({columns}) VALUES (:id, :at, 'bo', 'x', '/', '1', :d)"
        for n in range(2500):
            values = {"id": new_id(), "at": BEGUN + timedelta(seconds=n), "d": f'{{"n":{n}.50, "é":"\\u00e9"}}'}
            connection.execute(sa.text(insert).bindparams(sa.bindparam("at", type_=sa.DateTime(timezone=True))), values)
    database.dispose()
    stores, database = open_stores(empty_database_url)
    report = stores.audit.verify()
    assert (report.whole, report.entries) == (True, 2500)
    stores.audit.add(entry(1))
    assert stores.audit.verify().sequence == 2501
    with database.write_connection() as connection:
        config.attributes["connection"] = connection
        command.downgrade(config, "0007")
        command.upgrade(config, "head")
    assert stores.audit.verify().whole
    database.dispose()


def test_entries_go_when_their_retention_ends_and_that_is_an_entry_too(trail: SqlAuditTrail) -> None:
    fill(trail, 10)
    retention = AuditRetention(trail, now() - BEGUN - timedelta(days=4.5))
    assert retention.look() == 1
    report = trail.verify()
    assert (report.whole, report.entries) == (True, 6)
    (newest, *_) = trail.list().items
    assert (newest.action, newest.detail["first"], newest.detail["last"]) == ("close_audit", 1, 5)
    assert retention.look() == 0, "nothing more is as old"


def test_a_broken_trail_keeps_all_and_says_so(
    database: Database, trail: SqlAuditTrail, caplog: pytest.LogCaptureFixture
) -> None:
    fill(trail, 3)
    execute(database, "UPDATE audit SET who = 'bo' WHERE sequence = 1")
    assert AuditRetention(trail, timedelta(days=1)).look() == 0
    assert trail.verify().entries == 3
    assert "the audit chain is broken" in caplog.text
