"""Roles and teams at work: rights follow a reservation's team, and a running job nobody's token."""

from collections.abc import Generator
from contextlib import ExitStack
from datetime import timedelta

import httpx
import pytest

from bench_service.app import open_service
from bench_service.cli.processes.serving import serving
from bench_service.model.manual import ManualLease
from bench_service.persistence import open_stores
from bench_service.settings import Settings
from bench_service.wall_clock import monotonic_s, new_id, now, pause
from tests.kit.people import House, free_port, house
from tests.service.client import Client

JOB = {"procedure": "no_operation", "unit": "SIM-0001"}


@pytest.fixture(scope="module")
def home(tmp_path_factory: pytest.TempPathFactory) -> Generator[House]:
    with house(tmp_path_factory.mktemp("teams")) as made:
        made.add_account("ada")
        yield made


@pytest.fixture(scope="module")
def people(home: House) -> dict[str, httpx.Client]:
    """Two operators of team alpha, one of beta, an engineer of beta, an admin of no team."""
    return {
        "al": home.program("al", "operator", team="alpha"),
        "amy": home.program("amy", "operator", team="alpha"),
        "bea": home.program("bea", "operator", team="beta"),
        "ben": home.program("ben", "engineer", team="beta"),
        "admin": home.person("ada"),
    }


@pytest.fixture
def reservation(people: dict[str, httpx.Client]) -> Generator[str]:
    """Al's, of the bench, for team alpha."""
    body = {"bench": "sim", "holder": "al", "minutes": 60}
    made = people["al"].post("/api/v1/reservations", json=body)
    assert made.status_code == 201, made.text
    assert made.json()["team"] == "alpha"
    yield made.json()["id"]
    people["admin"].delete(f"/api/v1/reservations/{made.json()['id']}")


@pytest.fixture
def approved(people: dict[str, httpx.Client]) -> Generator[dict]:
    answer = people["ben"].put("/api/v1/procedures/no_operation/approval")
    assert answer.status_code == 200, answer.text
    yield answer.json()
    people["ben"].delete("/api/v1/procedures/no_operation/approval")


def test_an_operator_runs_what_an_engineer_has_approved(people: dict[str, httpx.Client]) -> None:
    refused = people["al"].post("/api/v1/jobs", json=JOB)
    assert refused.status_code == 403
    assert "PUT /api/v1/procedures/no_operation/approval" in refused.json()["detail"]
    assert people["ben"].post("/api/v1/jobs", json=JOB).status_code == 202
    assert people["al"].put("/api/v1/procedures/no_operation/approval").status_code == 403
    approval = people["ben"].put("/api/v1/procedures/no_operation/approval").json()
    (listed,) = people["al"].get("/api/v1/approvals").json()
    assert listed == approval
    assert (approval["procedure"], approval["by"]) == ("no_operation", "ben")
    assert people["al"].post("/api/v1/jobs", json=JOB).status_code == 202
    assert people["al"].post("/api/v1/jobs", json={**JOB, "procedure": "none"}).status_code == 404
    assert people["ben"].delete("/api/v1/procedures/no_operation/approval").status_code == 204
    assert people["al"].post("/api/v1/jobs", json=JOB).status_code == 403
    assert people["ben"].put("/api/v1/procedures/none/approval").status_code == 404


def test_another_version_of_a_procedure_needs_a_new_approval(home: House, people: dict[str, httpx.Client]) -> None:
    people["ben"].put("/api/v1/procedures/no_operation/approval")
    import sqlite3

    with sqlite3.connect(home.settings.database_url.partition(":///")[2]) as books:
        books.execute("UPDATE approvals SET version = '0.0.1'")
    refused = people["al"].post("/api/v1/jobs", json=JOB)
    assert refused.status_code == 403
    assert "is approved as version 0.0.1, not" in refused.json()["detail"]
    people["ben"].delete("/api/v1/procedures/no_operation/approval")


def test_rights_follow_the_teams_reservation_not_the_submitter(
    people: dict[str, httpx.Client], reservation: str, approved: dict
) -> None:
    assert approved
    under = {**JOB, "reservation": reservation}
    for stranger in ("bea", "ben"):
        refused = people[stranger].post("/api/v1/jobs", json=under)
        assert (refused.status_code, refused.json()["type"]) == (403, "/problems/NotAllowed")
        assert "team alpha" in refused.json()["detail"]
        assert people[stranger].delete(f"/api/v1/reservations/{reservation}").status_code == 403
        assert people[stranger].post("/api/v1/benches/sim/release").status_code == 403
    job = people["al"].post("/api/v1/jobs", json=under).json()["id"]
    for verb, body in (("cancel", None), ("pause", None), ("resume", None), ("answer", {"done": True})):
        answer = people["bea"].post(f"/api/v1/jobs/{job}/{verb}", json=body)
        assert answer.status_code == 403, verb
    assert people["bea"].patch(f"/api/v1/jobs/{job}", json={"priority": 1}).status_code == 403
    assert people["amy"].patch(f"/api/v1/jobs/{job}", json={"priority": 1}).status_code == 200
    assert people["amy"].post(f"/api/v1/jobs/{job}/pause").status_code == 202, "a colleague's job"
    assert people["admin"].post(f"/api/v1/jobs/{job}/cancel").status_code == 202
    by_admin = people["admin"].post("/api/v1/jobs", json=under).json()["id"]
    assert people["al"].post(f"/api/v1/jobs/{by_admin}/cancel").status_code == 202, "the reservation's team counts"
    free = people["ben"].post("/api/v1/jobs", json=JOB).json()["id"]
    assert people["al"].post(f"/api/v1/jobs/{free}/cancel").status_code == 202, "without a reservation: any operator"
    assert people["bea"].post("/api/v1/benches/sim/stop").status_code == 202, "stop is for everybody who can see"
    assert people["bea"].post("/api/v1/benches/sim/release").status_code == 403
    assert people["al"].post("/api/v1/benches/sim/release").status_code == 200


def test_jobs_of_a_team_do_not_wait_for_its_other_reservation(people: dict[str, httpx.Client], approved: dict) -> None:
    assert approved
    bench = people["al"].post("/api/v1/reservations", json={"bench": "sim", "holder": "al", "minutes": 5}).json()["id"]
    unit = people["amy"].post("/api/v1/reservations", json={"unit": "SIM-0001", "holder": "amy", "minutes": 5})
    try:
        same = people["amy"].post("/api/v1/jobs", json={**JOB, "reservation": unit.json()["id"]}).json()
        other = people["bea"].post("/api/v1/jobs", json=JOB).json()
        assert "reserved" not in same["waiting"], same["waiting"]
        assert "reserved by al" in other["waiting"]
        for job in (same, other):
            people["admin"].post(f"/api/v1/jobs/{job['id']}/cancel")
    finally:
        for one in (bench, unit.json()["id"]):
            people["admin"].delete(f"/api/v1/reservations/{one}")


PLAN = {"name": "of-alpha", "steps": [{"name": "look", "procedure": "no_operation"}]}


@pytest.fixture(scope="module")
def engineers(home: House) -> dict[str, httpx.Client]:
    """Engineers of alpha, beta and of no team."""
    made = {name: home.program(f"eng-{name}", "engineer", team=name) for name in ("alpha", "beta")}
    return {**made, "none": home.program("eng-none", "engineer")}


def test_a_campaign_run_and_its_jobs_belong_to_the_team_that_started_it(
    home: House, people: dict[str, httpx.Client], engineers: dict[str, httpx.Client]
) -> None:
    assert engineers["alpha"].post("/api/v1/campaigns", json=PLAN).status_code == 201
    changed = {**PLAN, "description": "changed"}
    for stranger in ("beta", "none"):
        refused = engineers[stranger].put("/api/v1/campaigns/of-alpha", json=changed)
        assert (refused.status_code, "team alpha" in refused.json()["detail"]) == (403, True)
    assert engineers["alpha"].put("/api/v1/campaigns/of-alpha", json=changed).status_code == 200
    run = engineers["alpha"].post("/api/v1/campaigns/of-alpha/runs", json={"unit": "SIM-0001"}).json()
    assert run["team"] == "alpha"
    path = f"/api/v1/campaign-runs/{run['id']}"
    with ExitStack() as closing:  # as the process does that drives the bench
        open_service(home.settings, closing, drive=False).campaigns.conductor.look()
    job = people["admin"].get(path).json()["steps"][0]["job"]
    assert people["admin"].get(f"/api/v1/jobs/{job}").json()["team"] == "alpha"
    for stranger in (people["bea"], people["ben"]):
        for verb in (f"/api/v1/jobs/{job}/cancel", f"/api/v1/jobs/{job}/pause", f"{path}/cancel"):
            refused = stranger.post(verb)
            assert (refused.status_code, refused.json()["type"]) == (403, "/problems/NotAllowed"), verb
    assert people["bea"].get(path).status_code == 200, "everybody who is let in reads"
    assert people["al"].patch(f"/api/v1/jobs/{job}", json={"priority": 2}).status_code == 200
    assert people["amy"].post(f"{path}/cancel").status_code == 202


def test_a_label_does_not_make_a_job_another_teams(people: dict[str, httpx.Client]) -> None:
    """The team of a job is stored with it: what a client writes into a label gives no right and takes none."""
    labels = {"campaign_run": "a run of alpha", "team": "alpha"}
    job = people["ben"].post("/api/v1/jobs", json={**JOB, "labels": labels}).json()
    assert job["team"] == ""
    assert people["ben"].post("/api/v1/jobs", json={**JOB, "team": "alpha"}).status_code == 422
    assert people["al"].post(f"/api/v1/jobs/{job['id']}/cancel").status_code == 202


def test_runs_of_a_schedule_are_of_the_schedules_team(
    people: dict[str, httpx.Client], engineers: dict[str, httpx.Client]
) -> None:
    assert people["admin"].post("/api/v1/campaigns", json={**PLAN, "name": "nightly"}).status_code == 201
    when = {"cron": "* * * * *", "time_zone": "UTC", "campaign": "nightly", "unit": "SIM-0001", "enabled": False}
    schedule = engineers["beta"].post("/api/v1/schedules", json=when).json()
    assert schedule["team"] == "beta"
    path = f"/api/v1/schedules/{schedule['id']}"
    for stranger in ("alpha", "none"):
        assert engineers[stranger].patch(path, json={"enabled": True}).status_code == 403
        assert engineers[stranger].delete(path).status_code == 403
    assert engineers["none"].put("/api/v1/campaigns/nightly", json={**PLAN, "name": "nightly"}).status_code == 200
    assert engineers["beta"].delete(path).status_code == 204


def test_a_job_goes_on_when_its_submitters_token_is_revoked(tmp_path_factory: pytest.TempPathFactory) -> None:
    folder = tmp_path_factory.mktemp("driven")
    settings = Settings(database_url=f"sqlite:///{folder / 'bench.sqlite'}", port=free_port())
    with house(folder) as first:
        first.add_account("ada")
        token = first.add_token("nightly", "engineer")
    with serving(settings), httpx.Client(base_url=f"http://127.0.0.1:{settings.port}", timeout=60) as http:
        http.headers["Authorization"] = f"Bearer {token}"
        job = Client(http).submit(seed=3)["id"]
        said = http.stream("GET", f"/api/v1/jobs/{job}/events")
        with said as stream, httpx.Client(base_url=http.base_url) as admin:
            answer = admin.post("/api/v1/session", json={"name": "ada", "password": "a horse and a stair"})
            admin.headers["X-CSRF-Token"] = answer.json()["csrf"]
            assert stream.status_code == 200, "a stream of events takes the header"
            assert admin.delete("/api/v1/tokens/nightly").status_code == 200
            assert http.get("/api/v1/jobs").status_code == 401
            with admin.stream("GET", f"/api/v1/jobs/{job}/events") as by_cookie:
                assert by_cookie.status_code == 200, "and the cookie"
            deadline_s = monotonic_s() + 60
            while (state := admin.get(f"/api/v1/jobs/{job}").json()["state"]) in ("queued", "running"):
                assert monotonic_s() < deadline_s
                pause(0.05)
            assert state == "succeeded"
            assert "succeeded" not in b"".join(stream.iter_raw()).decode(), "the stream of a revoked token has ended"
            with httpx.Client(base_url=http.base_url) as nobody:
                assert nobody.get(f"/api/v1/jobs/{job}/events").status_code == 401
                assert nobody.get(f"/api/v1/jobs/{job}/events", params={"token": token}).status_code == 400


def open_lease(home: House, reservation: str | None) -> str:
    """Open al's lease of manual mode, as where a worker drives the bench; its address."""
    stores, opened = open_stores(home.settings.database_url)
    at = now()
    lease = ManualLease(
        new_id(), "sim", "SIM-0001", "al", True, "a look", at, at + timedelta(minutes=5), reservation=reservation
    )
    stores.manual.begin(lease)
    opened.dispose()
    return f"/api/v1/benches/sim/manual/{lease.id}"


def test_manual_mode_follows_its_own_reservation_and_no_later_one(home: House, people: dict[str, httpx.Client]) -> None:
    """A later reservation of another team would take `halt` from the operator at a turning table."""
    lease, halt = open_lease(home, None), {"kind": "halt"}
    later = people["bea"].post("/api/v1/reservations", json={"bench": "sim", "holder": "bea", "minutes": 5}).json()
    assert people["al"].post(f"{lease}/demands", json=halt).status_code == 202
    assert people["al"].post(f"{lease}/renew", json={"minutes": 3}).status_code == 200
    assert people["al"].post(f"{lease}/end").status_code == 200, "without a reservation: any operator"
    assert people["bea"].delete(f"/api/v1/reservations/{later['id']}").status_code == 200

    unit = people["al"].post("/api/v1/reservations", json={"unit": "SIM-0001", "holder": "al", "minutes": 5}).json()
    body = {"reason": "a look", "reservation": unit["id"]}
    refused = people["bea"].post("/api/v1/benches/sim/manual", json=body)
    assert (refused.status_code, "team alpha" in refused.json()["detail"]) == (403, True)
    assert people["al"].post("/api/v1/benches/sim/manual", json=body).status_code == 503, "nothing drives this bench"
    lease = open_lease(home, unit["id"])
    for verb, given in (("demands", halt), ("renew", {"minutes": 3}), ("end", None)):
        refused = people["bea"].post(f"{lease}/{verb}", json=given)
        assert (refused.status_code, "team alpha" in refused.json()["detail"]) == (403, True), verb
    assert people["al"].post(f"{lease}/demands", json=halt).status_code == 202
    assert people["amy"].post(f"{lease}/end").status_code == 200, "a colleague's"
    people["admin"].delete(f"/api/v1/reservations/{unit['id']}")
    assert people["al"].post("/api/v1/benches/sim/manual/none/end").status_code == 404
