"""Stops over HTTP: each has an id, several stand beside each other, a release names one, by name and with a remark."""

import sqlite3
from collections.abc import Generator
from pathlib import Path

import httpx
import pytest

from bench_service.bench.processes import HOST
from bench_service.bench.safety import SafetyService
from bench_service.cli.asking.client import connect
from bench_service.drivers.simulated import SimulatedDriver
from bench_service.model.errors import NotSafe
from bench_service.persistence import open_stores
from bench_service.settings import Settings
from bench_service.wall_clock import monotonic_s
from tests.kit.busy_machine import BUSY_S
from tests.service.client import Client
from tests.service.page import page

BENCH = "/api/v1/benches/sim"


@pytest.fixture(scope="module")
def service(tmp_path_factory: pytest.TempPathFactory) -> Generator[Client]:
    url = f"sqlite:///{tmp_path_factory.mktemp('stops') / 'bench.sqlite'}"
    with connect(Settings(database_url=url), None, drive=True) as http:
        yield Client(http)


@pytest.fixture
def client(service: Client) -> Generator[Client]:
    """A bench that is not stopped, and is not when the test is over."""
    yield service
    for stop in service.http.get(BENCH).json()["stops"]:
        assert release(service, stop["id"], by="a test", remark="over").is_success


def stopped(client: Client, reason: str, by: str) -> str:
    """The id of a stop."""
    answer = client.http.post(f"{BENCH}/stop", json={"reason": reason, "by": by})
    assert answer.status_code == 202, answer.text
    return answer.json()["stop"]


def release(client: Client, stop: str, **body: object) -> httpx.Response:
    return client.http.post(f"{BENCH}/stops/{stop}/release", json=body)


def test_two_people_stop_a_bench_and_it_works_again_when_both_stops_are_released(client: Client) -> None:
    smoke, reach = stopped(client, "smoke", "Ada"), stopped(client, "I reach into it", "Bo")
    job = client.submit("no_operation")["id"]
    view = client.http.get(BENCH).json()
    assert view["state"] == "stopped"
    assert [(s["id"], s["by"], s["reason"]) for s in view["stops"]] == [
        (smoke, "Ada", "smoke"),
        (reach, "Bo", "I reach into it"),
    ]
    assert view["stopped"].endswith("smoke; I reach into it")
    assert client.http.get("/readyz").json()["notes"] == ["bench sim is stopped: smoke; I reach into it"]
    assert 'bench_stops_standing{bench="sim"} 2.0' in client.http.get("/metrics").text
    answer = release(client, smoke, by="Cy", remark="the fan was dusty")
    assert answer.status_code == 200, answer.text
    assert answer.json()["stop"]["released_by"] == "Cy", "another's stop, under his own name"
    assert [s["id"] for s in answer.json()["standing"]] == [reach]
    assert client.http.get(BENCH).json()["stopped"].endswith("I reach into it")
    assert client.job(job)["waiting"] == "bench sim is stopped: I reach into it"
    assert release(client, reach, by="Bo", remark="out again").json()["standing"] == []
    assert client.wait(job)["state"] == "succeeded"
    listed = client.http.get(f"{BENCH}/stops", params={"limit": 2}).json()
    assert [(s["id"], s["released_by"], s["remark"]) for s in listed["items"]] == [
        (reach, "Bo", "out again"),
        (smoke, "Cy", "the fan was dusty"),
    ]
    assert all(s["released_at"] > s["at"] for s in listed["items"])


def test_a_release_without_an_id_is_refused_where_it_is_not_clear_which_stop_is_meant(client: Client) -> None:
    first, second = stopped(client, "smoke", "Ada"), stopped(client, "I reach into it", "Bo")
    refused = client.http.post(f"{BENCH}/release")
    assert (refused.status_code, refused.json()["type"]) == (409, "/problems/SeveralStops")
    assert [e["value"] for e in refused.json()["errors"]] == [first, second]
    assert "by Bo: I reach into it" in refused.json()["errors"][1]["message"]
    assert [s["id"] for s in client.http.get(BENCH).json()["stops"]] == [first, second]
    release(client, first, by="Ada", remark="looked")
    released = client.http.post(f"{BENCH}/release", headers={"X-Requested-By": "Cy"})
    assert (released.status_code, released.json()["stops"]) == (200, [])
    newest = client.http.get(f"{BENCH}/stops", params={"limit": 1}).json()
    assert (newest["items"][0]["id"], newest["items"][0]["released_by"]) == (second, "Cy")
    older = client.http.get(f"{BENCH}/stops", params={"limit": 1, "after": newest["next"]}).json()
    assert [s["id"] for s in older["items"]] == [first]
    assert client.http.post(f"{BENCH}/release").status_code == 200, "a bench that is not stopped stays as it is"


@pytest.mark.parametrize(
    ("body", "field"),
    [
        ({"by": "Bo"}, "remark"),
        ({"by": "Bo", "remark": ""}, "remark"),
        ({"remark": "looked"}, "by"),
        ({"by": "B\to", "remark": "looked"}, "by"),
        ({"by": "Bo", "remark": "looked", "all": True}, "all"),
    ],
)
def test_a_release_says_who_and_what_was_looked_at(client: Client, body: dict, field: str) -> None:
    stop = stopped(client, "smoke", "Ada")
    refused = release(client, stop, **body)
    assert (refused.status_code, [e["field"] for e in refused.json()["errors"]]) == (422, [field])
    assert client.http.get(BENCH).json()["state"] == "stopped"


def test_the_name_may_come_as_a_header_and_may_be_in_any_script(client: Client) -> None:
    path = f"{BENCH}/stops/{stopped(client, 'дим', 'Ада')}/release"
    answer = client.http.post(path, json={"remark": "оглянуто"}, headers={"X-Requested-By": "Bo"})
    stop = answer.json()["stop"]
    assert (stop["by"], stop["reason"], stop["released_by"], stop["remark"]) == ("Ада", "дим", "Bo", "оглянуто")


def test_a_release_of_what_is_released_or_not_there_is_refused(client: Client) -> None:
    stop = stopped(client, "smoke", "Ada")
    assert release(client, "none", by="Bo", remark="looked").status_code == 404
    assert client.http.get("/api/v1/benches/none/stops").status_code == 404
    assert release(client, stop, by="Bo", remark="looked").status_code == 200
    assert release(client, stop, by="Bo", remark="looked").status_code == 200, "the same, asked again"
    late = release(client, stop, by="Cy", remark="looked")
    assert late.status_code == 409
    assert "by Bo" in late.json()["detail"]


def test_a_bench_that_is_not_safe_is_not_released(client: Client, monkeypatch: pytest.MonkeyPatch) -> None:
    stop = stopped(client, "smoke", "Ada")

    def unsafe(_self: object, bench_id: str) -> None:
        raise NotSafe(f"bench {bench_id!r} is not released: the table moves")

    with monkeypatch.context() as patch:
        patch.setattr(SafetyService, "require", unsafe)
        refused = release(client, stop, by="Bo", remark="looked")
    assert (refused.status_code, refused.json()["type"]) == (409, "/problems/NotSafe")
    assert client.http.get(BENCH).json()["stops"][0]["id"] == stop
    assert release(client, stop, by="Bo", remark="looked").status_code == 200


def test_the_first_page_says_who_stopped_it_and_why_also_without_scripts(client: Client) -> None:
    stops = [stopped(client, "<b>smoke</b>", "Ada & Co"), stopped(client, "I reach into it", "Bo")]
    home = page(client, "/")
    assert ("action", "/benches/sim/stop") in home.attributes
    words = " ".join(home.words.split())
    assert "by Ada & Co: <b>smoke</b>" in words
    assert "by Bo: I reach into it" in words
    assert all(stop in words for stop in stops)
    release(client, stops[0], by="Cy", remark="the <i>fan</i>")
    history = page(client, "/benches/sim/stops")
    assert "the <i>fan</i>" in history.words
    assert "stands" in history.words
    assert client.http.get("/benches/none/stops").status_code == 404


def test_a_stop_that_cannot_be_written_is_not_answered_as_done(tmp_path: Path) -> None:
    file = tmp_path / "bench.sqlite"
    stores, database = open_stores(f"sqlite:///{file}")
    stores.benches.put_bench(SimulatedDriver("sim").description)
    database.dispose()
    with connect(Settings(database_url=f"sqlite:///{file}"), None, drive=False) as http:
        other = sqlite3.connect(file)
        other.execute("CREATE TRIGGER full BEFORE INSERT ON bench_stops BEGIN SELECT RAISE(ABORT, 'no room'); END")
        other.commit()
        other.close()
        assert http.post(f"{BENCH}/stop").status_code == 503
        assert http.get(f"{BENCH}/stops").json()["items"] == []


def test_a_stop_on_its_own_host_that_nothing_has_taken_is_answered_with_503_and_says_where_to_press(
    tmp_path: Path,
) -> None:
    """Its channel takes nothing, as where the folder is another user's; it was answered with 202 all the same."""
    file = tmp_path / "bench.sqlite"
    stores, database = open_stores(f"sqlite:///{file}")
    stores.benches.put_bench(SimulatedDriver("sim").description)
    database.dispose()
    settings = Settings(database_url=f"sqlite:///{file}")
    (settings.devices_in() / "bench-sim.stop").mkdir(parents=True)
    with connect(settings, None, drive=False) as http:
        other = sqlite3.connect(file, isolation_level=None)
        other.execute("BEGIN EXCLUSIVE")
        try:
            begun_s = monotonic_s()
            answer = http.post(f"{BENCH}/stop", json={"reason": "smoke", "by": "Ada"})
            took_s = monotonic_s() - begun_s
        finally:
            other.execute("ROLLBACK")
            other.close()
        assert answer.status_code == 503, answer.text
        assert took_s < BUSY_S, "a second for the database, below the 30 s of its lock"
        said = answer.json()["detail"]
        assert "has NOT reached bench 'sim': its stop channel on this host takes nothing" in said
        assert f"Press the hardware emergency stop, or run `bench stop --bench sim` at host {HOST}" in said
        taken = http.post(f"{BENCH}/stop", json={"reason": "smoke again", "by": "Ada", "wait": False})
        assert taken.status_code == 202, "the database has taken it, and the other one by now"
        assert {"smoke", "smoke again"} == {one["reason"] for one in http.get(f"{BENCH}/stops").json()["items"]}


def test_a_stop_sent_again_with_its_key_is_the_same_stop_and_after_its_release_changes_nothing(client: Client) -> None:
    body, key = {"reason": "smoke", "by": "Ada"}, {"Idempotency-Key": "press 1"}
    first = client.http.post(f"{BENCH}/stop", json=body, headers=key).json()["stop"]
    again = client.http.post(f"{BENCH}/stop", json=body, headers=key)
    assert (again.status_code, again.json()["stop"]) == (202, first)
    other = client.http.post(f"{BENCH}/stop", json={**body, "by": "Bo"}, headers=key).json()["stop"]
    assert other != first  # no stop is refused for its key
    assert [stop["id"] for stop in client.http.get(BENCH).json()["stops"]] == [first, other]
    for stop in (first, other):
        assert release(client, stop, by="Cy", remark="looked at").is_success
    client.http.post(f"{BENCH}/stop", json={**body, "by": "Bo"}, headers=key)
    assert client.http.get(BENCH).json()["stops"] == []


def test_sixteen_stops_stand_at_the_most_and_one_more_is_told_that_it_waits(client: Client) -> None:
    first = stopped(client, "reason 0", "Ada")
    for number in range(1, 16):
        stopped(client, f"reason {number}", "Ada")
    more = client.http.post(f"{BENCH}/stop", json={"reason": "one more", "by": "Bo"})
    assert more.status_code == 202
    assert "16 stops of bench 'sim' stand already" in more.json()["books"]
    assert len(client.http.get(BENCH).json()["stops"]) == 16
    assert release(client, first, by="Cy", remark="looked at").is_success
    assert client.http.get(BENCH).json()["state"] == "stopped"


def test_a_stop_of_a_bench_that_is_not_there_is_refused_also_where_nobody_waits(client: Client) -> None:
    """Seen once: with `wait` false the database was not waited for, and the answer was that it does not answer."""
    for wait in (True, False):
        answer = client.http.post("/api/v1/benches/nowhere/stop", json={"reason": "x", "wait": wait})
        assert answer.status_code == 404, answer.text
