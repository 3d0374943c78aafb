"""The stop needs no log-in on this host, and elsewhere no database: whom the service knew before may stop."""

import sqlite3
from collections.abc import Generator
from contextlib import contextmanager
from datetime import timedelta

import httpx
import pytest

from bench_service.access.credentials import IDLE, STOPS_AFTER_END
from bench_service.api.access import identify
from bench_service.bench.stop.channel import StopChannel
from bench_service.wall_clock import monotonic_s, now
from tests.kit.busy_machine import BUSY_S
from tests.kit.people import CSRF, House, house

STOP = "/api/v1/benches/sim/stop"
AFAR = {"X-Forwarded-For": "192.0.2.7"}
"""As a proxy on this host says for whom it asks: the request is from elsewhere, and needs a proof."""
IN_TIME_S = BUSY_S
"""Below the 30 s for which a writer waits for the lock; above the 1.8 s of waiting and a busy machine."""


@pytest.fixture(scope="module")
def home(tmp_path_factory: pytest.TempPathFactory) -> Generator[House]:
    with house(tmp_path_factory.mktemp("stops")) as made:
        made.add_account("ada")
        yield made


@contextmanager
def locked(home: House) -> Generator[None]:
    """Another program holds the database's lock, for as long as it wants."""
    file = home.settings.database_url.partition(":///")[2]
    other = sqlite3.connect(file, isolation_level=None)
    other.execute("BEGIN EXCLUSIVE")
    try:
        yield
    finally:
        other.execute("ROLLBACK")
        other.close()


def stop(client: httpx.Client, reason: str = "smoke", **headers: str) -> httpx.Response:
    return client.post(STOP, json={"reason": reason}, headers=headers)


def release_all(home: House) -> None:
    """Release every stop, so that the next test begins without one."""
    for one in home.owner.get("/api/v1/benches/sim/stops").json()["items"]:
        if one["released_at"] is None:
            home.owner.post(f"/api/v1/benches/sim/stops/{one['id']}/release", json={"remark": "test", "by": "test"})


def passed_on(home: House, answer: httpx.Response) -> bool:
    """Whether the bench's own channel has the stop, where worker and supervisor see it."""
    words = StopChannel(home.settings.devices_in(), "sim").standing()
    return answer.json()["stop"] in {word.id for word in words}


def test_whoever_sees_the_bench_stops_it(home: House) -> None:
    viewer = home.program("eye", "viewer")
    assert stop(viewer).json()["books"] is None
    release_all(home)
    stop(viewer)
    assert viewer.post("/api/v1/benches/sim/release").status_code == 403, "a viewer's stop needs an operator"
    operator = home.program("hand", "operator")
    assert operator.post("/api/v1/benches/sim/release").status_code == 200


def test_with_the_database_locked_a_known_session_and_a_known_token_stop_at_once(home: House) -> None:
    viewer, person = home.program("eye-2", "viewer"), home.person("ada")
    assert viewer.get("/api/v1/benches", headers=AFAR).status_code == 200
    del person.headers[CSRF]
    with locked(home):
        for number, client in enumerate((viewer, person)):
            begun_s = monotonic_s()
            answer = stop(client, **AFAR)
            took_s = monotonic_s() - begun_s
            assert answer.status_code == 202, answer.text
            assert passed_on(home, answer)
            assert answer.json()["books"] is not None, "the books follow"
            assert took_s < IN_TIME_S, (number, took_s)


def test_with_the_database_locked_a_request_on_this_host_stops_without_any_name(home: House) -> None:
    with locked(home):
        for given in ({}, {"Authorization": "Bearer nobody-s-token"}, {"Cookie": "bench_session=nobody-s"}):
            begun_s = monotonic_s()
            answer = stop(home.client(**given))
            took_s = monotonic_s() - begun_s
            assert answer.status_code == 202, answer.text
            assert passed_on(home, answer)
            assert took_s < IN_TIME_S, took_s


def test_a_stop_without_a_log_in_is_nobodys_whatever_name_it_gives(home: House) -> None:
    answer = home.client().post(STOP, json={"reason": "a hand", "by": "ada"}, headers={"X-Requested-By": "ada"})
    assert answer.status_code == 202, answer.text
    (stopped,) = [
        one for one in home.owner.get("/api/v1/benches/sim/stops").json()["items"] if one["id"] == answer.json()["stop"]
    ]
    assert stopped["by"] == "127.0.0.1"
    entry = home.owner.get("/api/v1/audit", params={"limit": 1, "who": "127.0.0.1"}).json()["items"][0]
    assert (entry["action"], entry["detail"]["claimed"]) == ("stop", "ada")
    assert "proof" not in entry["detail"]


def test_nobody_from_elsewhere_stops_and_no_page_of_another_site(home: House) -> None:
    assert stop(home.client(**AFAR), "never").status_code == 401
    assert stop(home.client(**AFAR, Authorization="Bearer nobody-s-token"), "never").status_code == 401
    for foreign in ({"Origin": "https://evil.example"}, {"Sec-Fetch-Site": "cross-site"}, {"Host": "evil.example"}):
        assert stop(home.client(**foreign), "never").status_code in (403, 421)
        assert stop(home.person("ada"), "never", **foreign).status_code in (403, 421)
    assert "never" not in {one["reason"] for one in home.owner.get("/api/v1/benches/sim/stops").json()["items"]}


def test_a_page_left_open_over_the_weekend_still_stops_and_does_nothing_else(
    home: House, monkeypatch: pytest.MonkeyPatch
) -> None:
    person = home.person("ada")
    monkeypatch.setattr(identify, "now", lambda: now() + IDLE + timedelta(days=2))
    answer = stop(person, **AFAR)
    assert answer.status_code == 202, answer.text
    assert person.get("/api/v1/jobs").status_code == 401
    found = home.owner.get("/api/v1/benches/sim/stops").json()["items"][0]
    assert found["by"] == "ada"
    assert person.post("/api/v1/benches/sim/release").status_code == 401
    monkeypatch.setattr(identify, "now", lambda: now() + IDLE + STOPS_AFTER_END + timedelta(minutes=1))
    assert stop(person, **AFAR).status_code == 401
    monkeypatch.undo()
    ended = home.person("ada")
    assert ended.delete("/api/v1/session").status_code == 204
    kept = home.client(Cookie=f"bench_session={person.cookies['bench_session']}", **AFAR)
    assert kept.delete("/api/v1/session", headers={CSRF: person.headers[CSRF]}).status_code == 204
    assert stop(kept).status_code == 401, "one that was ended does not"
