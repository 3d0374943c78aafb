"""Over HTTP: a job that another version stored, in words that this one does not know, is in nobody's way."""

import pytest
import sqlalchemy as sa

from bench_service.persistence.tables.jobs import JobRow
from tests.service.client import Client

WORDS = {
    "stations": [{"index_of_a_later_version": 0}],
    "context": {"unit_of_a_later_version": {}},
}


def spoil(database_url: str, job_id: str, column: str) -> None:
    engine = sa.create_engine(database_url, poolclass=sa.NullPool)
    with engine.begin() as connection:
        connection.execute(sa.update(JobRow).where(JobRow.id == job_id).values({column: WORDS[column]}))


@pytest.fixture
def stopped(client: Client) -> Client:
    assert client.http.post("/api/v1/benches/sim/stop", json={"reason": "lunch"}).is_success
    return client


@pytest.mark.parametrize("column", WORDS)
def test_the_dispatcher_interrupts_it_and_goes_on(stopped: Client, database_url: str, column: str) -> None:
    foreign, behind = (stopped.submit("no_operation")["id"] for _ in range(2))
    spoil(database_url, foreign, column)
    assert stopped.http.post("/api/v1/benches/sim/release").is_success
    assert stopped.wait(behind, seconds=10.0)["state"] == "succeeded"
    with sa.create_engine(database_url, poolclass=sa.NullPool).connect() as connection:
        state, failure = connection.execute(sa.select(JobRow.state, JobRow.failure).where(JobRow.id == foreign)).one()
    assert failure is not None
    assert (state, failure["kind"]) == ("interrupted", "NotUnderstood")
    assert foreign in failure["message"]
    assert "\n" not in failure["message"]


def test_it_is_refused_listed_without_and_cancelled(stopped: Client, database_url: str) -> None:
    foreign, other = (stopped.submit("no_operation")["id"] for _ in range(2))
    spoil(database_url, foreign, "stations")
    refused = stopped.http.get(f"/api/v1/jobs/{foreign}")
    assert (refused.status_code, refused.json()["type"]) == (409, "/problems/NotUnderstood")
    assert f"job {foreign} was stored by version" in refused.json()["detail"]
    assert "\n" not in refused.json()["detail"]
    newest = stopped.http.get("/api/v1/jobs", params={"limit": 1}).json()
    assert [job["id"] for job in newest["items"]] == [other]
    without = stopped.http.get("/api/v1/jobs", params={"limit": 1, "after": newest["next"]}).json()
    assert (without["items"], without["next"]) in (([], foreign), ([], None))
    assert stopped.http.get("/").is_success
    queue = stopped.http.get("/api/v1/benches/sim/queue").json()
    assert [entry["job"] for entry in queue["entries"]] == [foreign, other]
    cancelled = stopped.http.post(f"/api/v1/jobs/{foreign}/cancel")
    assert (cancelled.status_code, cancelled.json()["state"]) == (200, "cancelled")
    assert foreign in cancelled.json()["waiting"]
    again = stopped.http.post(f"/api/v1/jobs/{foreign}/cancel")
    assert (again.status_code, again.json()["type"]) == (409, "/problems/IllegalTransition")
    assert stopped.http.post("/api/v1/benches/sim/release").is_success
    assert stopped.wait(other)["state"] == "succeeded"


def test_one_that_was_begun_ends_interrupted_and_leaves_the_bench_to_others(client: Client, database_url: str) -> None:
    """A new version finds a job that an old one began, and the engine continues with it."""
    long = {"dwell_s": 300.0, "settle_s": 0.5}
    foreign = client.submit(parameters=long)["id"]
    client.wait(foreign, "running")
    spoil(database_url, foreign, "stations")
    behind = client.submit("no_operation")["id"]
    assert client.wait(behind, seconds=30.0)["state"] == "succeeded"
    with sa.create_engine(database_url, poolclass=sa.NullPool).connect() as connection:
        state, failure = connection.execute(sa.select(JobRow.state, JobRow.failure).where(JobRow.id == foreign)).one()
    assert failure is not None
    assert (state, failure["kind"]) == ("interrupted", "NotUnderstood")
    assert client.http.get("/api/v1/benches/sim").json()["safety"]["safe"] is True
