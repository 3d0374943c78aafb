"""Log-in and tokens over HTTP: what proves a name, and what does not; nothing of a secret is kept anywhere."""

import json
import logging
import sqlite3
from collections.abc import Generator
from datetime import datetime, timedelta
from pathlib import Path

import httpx
import pytest
from argon2 import PasswordHasher, Type, extract_parameters

from bench_service.access import passwords
from bench_service.access import service as access_service
from bench_service.access.credentials import IDLE, LONGEST
from bench_service.access.lockout import FREE
from bench_service.api.access import identify
from bench_service.cli.processes.logs import Lines, set_up
from bench_service.wall_clock import monotonic_s, now, pause
from tests.kit.people import CSRF, PASSWORD, SEEN_S, House, house

JOB = {"procedure": "no_operation", "unit": "SIM-0001"}


@pytest.fixture(scope="module")
def home(tmp_path_factory: pytest.TempPathFactory) -> Generator[House]:
    with house(tmp_path_factory.mktemp("access")) as made:
        made.add_account("ada")
        yield made


def submit(client: httpx.Client, **headers: str) -> httpx.Response:
    return client.post("/api/v1/jobs", json=JOB, headers=headers)


def trail(home: House, **query: object) -> list[dict]:
    return home.owner.get("/api/v1/audit", params={"limit": 500, **query}).json()["items"]


def test_without_accounts_everybody_on_the_host_works_as_before_and_the_page_says_so(tmp_path: Path) -> None:
    with house(tmp_path) as fresh, fresh.client() as http:
        assert submit(http, **{"X-Requested-By": "Bo"}).json()["requested_by"] == "Bo"
        said = http.get("/api/v1/session").json()
        assert (said["name"], said["role"], said["proof"], said["log_in_needed"]) == (None, "admin", "none", False)
        assert "One user, no accounts" in http.get("/").text
        assert "nobody needs to log in" in http.get("/log-in").text
        refused = http.post("/api/v1/accounts", json={"name": "eve", "role": "admin", "password": PASSWORD})
        assert refused.status_code == 403, "the first account is made on the host, not by a program that asks"
        assert "bench user add" in refused.json()["detail"]
        assert http.post("/api/v1/tokens", json={"name": "eve", "role": "admin"}).status_code == 403
        viewer = fresh.owner.post("/api/v1/accounts", json={"name": "bo", "role": "viewer", "password": PASSWORD})
        assert viewer.status_code == 409, "the first one is an admin's: nobody could let the others in"
        fresh.add_account("ada")
        assert submit(http).status_code == 401, "the first account switches log-in on"
        assert http.get("/", follow_redirects=False).headers["location"] == "/log-in"
        assert fresh.owner.delete("/api/v1/accounts/ada").status_code == 204, "the owner removes the only one"
        deadline_s = monotonic_s() + SEEN_S
        while submit(http).status_code != 202:
            assert monotonic_s() < deadline_s
            pause(0.05)


def test_a_log_in_gives_a_cookie_that_no_script_reads_and_no_other_site_sends(home: House) -> None:
    with home.client() as http:
        answer = http.post("/api/v1/session", json={"name": " ADA ", "password": PASSWORD})
        assert answer.status_code == 201
        said = answer.json()
        assert (said["name"], said["role"], said["proof"]) == ("ada", "admin", "session")
        name, *attributes = [part.strip() for part in answer.headers["set-cookie"].split(";")]
        assert name.startswith("bench_session=")
        assert {"HttpOnly", "SameSite=strict", "Path=/"} <= set(attributes)
        assert "Secure" not in attributes, "over plain HTTP a browser would not send it"
        assert not any(one.startswith("Domain") for one in attributes)
        assert answer.headers["cache-control"] == "no-store"
        again = http.get("/api/v1/session").json()
        assert {**again, "expires_at": said["expires_at"]} == said
        assert "ada, admin" in http.get("/").text


@pytest.mark.parametrize("sent", [{"X-Forwarded-Proto": "https"}, {"Origin": "https://127.0.0.1", "Host": "127.0.0.1"}])
def test_over_https_the_cookie_goes_over_https_alone(home: House, sent: dict[str, str]) -> None:
    with home.client() as http:
        answer = http.post("/api/v1/session", json={"name": "ada", "password": PASSWORD}, headers=sent)
        assert answer.status_code == 201, answer.text
        name, *attributes = [part.strip() for part in answer.headers["set-cookie"].split(";")]
        assert name.startswith("__Host-bench_session=")
        assert "Secure" in attributes
        cookie = {"Cookie": name}
    with home.client(**cookie) as http:
        assert http.get("/api/v1/session").json()["name"] == "ada"


def test_a_cookie_alone_changes_nothing(home: House) -> None:
    """CSRF: a browser sends the cookie by itself; what a page of ours adds it does not."""
    with home.person("ada") as http:
        csrf = http.headers.pop(CSRF)
        other = home.person("ada")
        for given in ({}, {CSRF: ""}, {CSRF: "0" * 64}, {CSRF: other.headers[CSRF]}, {CSRF: csrf[:-1]}):
            for method, path in (("POST", "/api/v1/jobs"), ("POST", "/api/v1/tokens"), ("DELETE", "/api/v1/session")):
                answer = http.request(method, path, json=None if method == "DELETE" else JOB, headers=given)
                assert (answer.status_code, answer.json()["type"]) == (403, "/problems/CsrfToken"), (given, path)
        assert submit(http, **{CSRF: csrf}).status_code == 202
        assert f'<meta name="csrf" content="{csrf}">' in http.get("/").text
        foreign = {CSRF: csrf, "Origin": "https://evil.example"}
        assert submit(http, **foreign).json()["type"] == "/problems/ForeignOrigin"
        rebound = {CSRF: csrf, "Host": "evil.example"}
        assert submit(http, **rebound).json()["type"] == "/problems/ForeignHost"
        for path in ("/", "/log-in"):
            assert "frame-ancestors 'none'" in http.get(path).headers["content-security-policy"]
        other.close()


def test_a_log_in_takes_no_session_that_was_there_before(home: House) -> None:
    """Fixation: a secret that somebody else has put into the browser is not the one after the log-in."""
    planted = "A" * 43
    with home.client(Cookie=f"bench_session={planted}") as http:
        answer = http.post("/api/v1/session", json={"name": "ada", "password": PASSWORD})
        assert answer.status_code == 201
        assert planted not in answer.headers["set-cookie"]
        assert http.get("/api/v1/jobs").status_code == 401, "the planted one is nobody's"
    first = home.person("ada")
    before = first.cookies["bench_session"]
    first.headers.pop(CSRF)
    assert first.post("/api/v1/session", json={"name": "ada", "password": PASSWORD}).status_code == 201
    assert first.cookies["bench_session"] != before
    with home.client(Cookie=f"bench_session={before}") as http:
        assert http.get("/api/v1/jobs").status_code == 401, "a log-in ends the session that the browser had"
    first.close()


def test_after_the_log_out_the_session_is_over(home: House) -> None:
    with home.person("ada") as http:
        kept = http.cookies["bench_session"]
        answer = http.delete("/api/v1/session")
        assert answer.status_code == 204
        assert "Max-Age=0" in answer.headers["set-cookie"]
        assert "bench_session" not in http.cookies
        assert http.get("/api/v1/jobs").status_code == 401
    with home.client(Cookie=f"bench_session={kept}") as http:
        assert http.get("/api/v1/jobs").status_code == 401, "a copy of the cookie is worth nothing"


def test_failures_lock_a_name_whether_or_not_somebody_has_it(home: House) -> None:
    """Brute force: the right password does not help while the name is locked, and a new one unlocks it."""
    home.add_account("carol", "viewer")
    for name in ("carol", "no-such-name"):
        with home.client() as http:
            for guess in range(FREE):
                answer = http.post("/api/v1/session", json={"name": name, "password": f"guess number {guess}"})
                assert (answer.status_code, answer.json()["type"]) == (401, "/problems/WrongPassword"), name
                assert answer.json()["detail"] == "name or password is wrong"
            for password in ("one more guess", PASSWORD):
                locked = http.post("/api/v1/session", json={"name": name, "password": password})
                assert (locked.status_code, locked.json()["type"]) == (429, "/problems/LockedOut")
                assert 0 < int(locked.headers["retry-after"]) <= 60
    changed = home.owner.patch("/api/v1/accounts/carol", json={"password": f"{PASSWORD} 2"})
    assert changed.status_code == 200
    home.person("carol", f"{PASSWORD} 2").close()


def test_a_stored_password_is_argon2id_with_at_least_what_owasp_asks_for() -> None:
    """OWASP's password storage cheat sheet: 19 MiB and two passes, or 46 MiB and one."""
    stored = extract_parameters(PasswordHasher().hash(PASSWORD))
    assert stored.type is Type.ID
    assert stored.memory_cost >= 19 * 1024
    assert stored.time_cost >= 2
    assert not passwords.matches(PASSWORD, None)
    assert not passwords.matches(PASSWORD, "no hash")


def test_guesses_at_the_same_time_all_count(home: House) -> None:
    from concurrent.futures import ThreadPoolExecutor

    home.add_account("dave", "viewer")
    with home.client() as http, ThreadPoolExecutor(12) as pool:
        body = {"name": "dave", "password": "some guess or other"}
        answers = list(pool.map(lambda _: http.post("/api/v1/session", json=body).status_code, range(12)))
    assert set(answers) <= {401, 429}
    assert answers.count(401) <= FREE


def test_an_address_has_so_many_attempts_a_minute(home: House, monkeypatch: pytest.MonkeyPatch) -> None:
    """Spraying: one guess at each of many names."""
    monkeypatch.setattr(access_service.passwords, "matches", lambda *_: False)
    later = now() + timedelta(hours=1)  # so that what the tests before did is not counted
    monkeypatch.setattr(access_service, "now", lambda: later)
    with home.client() as http:
        answers = [
            http.post("/api/v1/session", json={"name": f"name{n}", "password": "Winter2026!"}).status_code
            for n in range(35)
        ]
    assert answers == [401] * 30 + [429] * 5


def test_a_session_ends_when_it_is_not_used_and_after_a_week(home: House, monkeypatch: pytest.MonkeyPatch) -> None:
    begun = now()
    with home.person("ada") as http:

        def at(moment: datetime) -> int:
            monkeypatch.setattr(identify, "now", lambda: moment)
            return http.get("/api/v1/jobs").status_code

        assert at(begun + IDLE - timedelta(minutes=5)) == 200
        assert at(begun + IDLE + timedelta(minutes=5)) == 401, "its use is noted by the clock, which has not moved"
        monkeypatch.undo()
        assert http.get("/api/v1/jobs").status_code == 200
        assert at(begun + LONGEST + timedelta(minutes=5)) == 401


def test_a_token_counts_until_it_is_revoked_or_expires(home: House, monkeypatch: pytest.MonkeyPatch) -> None:
    made = home.owner.post("/api/v1/tokens", json={"name": "short", "role": "viewer", "days": 1}).json()
    with home.client(Authorization=f"Bearer {made['token']}") as http:
        assert http.get("/api/v1/session").json()["name"] == "short"
        with monkeypatch.context() as patch:
            patch.setattr(identify, "now", lambda: now() + timedelta(days=1, seconds=1))
            assert "expired" in http.get("/api/v1/jobs").json()["detail"]
        assert http.get("/api/v1/jobs").status_code == 200
        same = home.owner.post("/api/v1/tokens", json={"name": "short", "role": "viewer"})
        assert same.status_code == 409
        assert home.owner.delete("/api/v1/tokens/short").json()["revoked_at"]
        deadline_s = monotonic_s() + SEEN_S
        while http.get("/api/v1/jobs").status_code != 401:
            assert monotonic_s() < deadline_s, "revoked by another process"
            pause(0.05)
    listed = home.owner.get("/api/v1/tokens").json()
    assert made["token"] not in json.dumps(listed)
    assert {"token", "digest"}.isdisjoint(listed[0])


@pytest.mark.parametrize("given", ["Bearer", "Bearer bench_", f"Bearer bench_{'A' * 43}", "bearer x y"])
def test_a_wrong_token_is_refused_also_here_and_whatever_else_is_sent(home: House, given: str) -> None:
    with home.person("ada") as http:
        answer = http.get("/api/v1/jobs", headers={"Authorization": given})
        assert (answer.status_code, answer.json()["type"]) == (401, "/problems/NoToken")
        assert answer.headers["www-authenticate"] == "Bearer"


def test_no_secret_is_in_the_database_the_trail_or_the_log(home: House, capsys: pytest.CaptureFixture[str]) -> None:
    set_up(home.settings.model_copy(update={"log_access": True}), "debug")
    token = home.add_token("quiet", "engineer")
    with home.person("ada") as person, home.client(Authorization=f"Bearer {token}") as program:
        cookie = person.cookies["bench_session"]
        program.post("/api/v1/jobs", json={**JOB, "labels": {"note": token}})
        for path in (f"/api/v1/jobs?access_token={token}", f"/api/v1/jobs/{token}", f"/jobs/bench%5F{token[6:]}"):
            refused = program.get(path)
            assert (refused.status_code, refused.json()["type"]) == (400, "/problems/TokenInAddress"), path
        person.post("/api/v1/accounts", json={"name": "x", "role": "admin", "password": "short one"})
        person.post("/api/v1/session", json={"name": "ada", "password": "a wrong password of hers"})
        person.post("/api/v1/session", json={"name": "ada", "passwort": PASSWORD, "password": {"a": PASSWORD}})
    said = "".join(capsys.readouterr())
    assert "TokenInAddress" in said
    kept = json.dumps(trail(home))
    assert "quiet" in kept
    file = Path(home.settings.database_url.partition(":///")[2])
    with sqlite3.connect(file) as books:
        stored = "\n".join(books.iterdump())
    for secret in (token, cookie, PASSWORD, "short one", "a wrong password of hers"):
        assert secret not in said, "the log"
        assert secret not in kept, "the trail"
        assert secret not in stored.replace(f'"note": "{token}"', "").replace(f"'note','{token}'", ""), "the database"


def test_a_line_of_the_log_hides_a_token_wherever_it_comes_from() -> None:
    token = f"bench_{'Ab-_' * 10}xyz"
    record = logging.LogRecord("bench_service", logging.INFO, "f", 1, "GET /x?t=%s", (token,), None)
    assert token not in Lines().format(record)
    assert "bench_[hidden]" in Lines().format(record)


def test_the_trail_has_the_proved_name_whatever_a_client_calls_itself(home: House) -> None:
    with home.person("ada") as person, home.program("nightly", "engineer") as program:
        by_person = submit(person, **{"X-Requested-By": "Somebody else"}).json()
        by_program = submit(program, **{"X-Requested-By": "Somebody else"}).json()
        assert (by_person["requested_by"], by_program["requested_by"]) == ("ada", "nightly")
        (entry,) = trail(home, target=by_person["id"])
        assert (entry["who"], entry["detail"]["proof"], entry["detail"]["claimed"]) == (
            "ada",
            "session",
            "Somebody else",
        )
        (entry,) = trail(home, target=by_program["id"])
        assert (entry["who"], entry["detail"]["proof"]) == ("nightly", "token")
        stop = person.post("/api/v1/benches/sim/stop", json={"reason": "smoke", "by": "Bo"}).json()["stop"]
        released = program.post(
            f"/api/v1/benches/sim/stops/{stop}/release", json={"remark": "looked", "by": "Bo"}
        ).json()["stop"]
        assert (released["by"], released["released_by"]) == ("ada", "nightly")
    with home.client() as http:
        http.post("/api/v1/session", json={"name": "ada", "password": "not hers at all"})
    refused = home.client(Authorization="Bearer nonsense").put("/api/v1/units/X-1", json={})
    assert refused.status_code == 401
    failed = [one for one in trail(home) if one["action"] == "log_in" and one["outcome"] == "401"]
    assert failed
    assert failed[0]["detail"]["body"] == {"name": "ada"}
    assert [one["outcome"] for one in trail(home) if one["action"] == "declare_unit"] == ["401"]


def test_commands_in_this_process_act_as_the_owner_of_the_files(home: House) -> None:
    said = home.owner.get("/api/v1/session").json()
    assert (said["proof"], said["role"]) == ("owner", "admin")
    job = submit(home.owner, **{"X-Requested-By": "somebody"}).json()
    assert job["requested_by"] == said["name"]


def test_a_wrong_account_is_refused_with_what_is_allowed(home: House) -> None:
    cases = {
        "name": {"name": "Ada!", "role": "viewer", "password": PASSWORD},
        "role": {"name": "eve", "role": "root", "password": PASSWORD},
        "password": {"name": "eve", "role": "viewer", "password": "short"},
    }
    for field, body in cases.items():
        answer = home.owner.post("/api/v1/accounts", json=body)
        assert answer.status_code == 422
        assert field in answer.json()["errors"][0]["field"]
        assert "short" not in answer.text
    for path in ("/api/v1/accounts", "/api/v1/tokens"):
        taken = home.owner.post(path, json={"name": "service-token", "role": "viewer"})
        assert taken.status_code == 422, "a name with which the service signs"
    twice = home.owner.post("/api/v1/accounts", json={"name": "ada", "role": "viewer", "password": PASSWORD})
    assert twice.status_code == 409
    assert home.owner.patch("/api/v1/accounts/ada", json={"role": "viewer"}).status_code == 409, "the last admin"
    assert home.owner.delete("/api/v1/accounts/ada").status_code == 409
    assert home.owner.delete("/api/v1/accounts/none").status_code == 404
    assert home.owner.delete("/api/v1/tokens/none").status_code == 404


@pytest.mark.parametrize("wanted", ["//evil.example", "https://evil.example", "/\\evil.example", "javascript:x", ""])
def test_the_log_in_leads_to_no_other_site(home: House, wanted: str) -> None:
    with home.client() as http:
        assert 'data-next="/"' in http.get("/log-in", params={"next": wanted}).text
        assert 'data-next="/jobs/1?a=b"' in http.get("/log-in", params={"next": "/jobs/1?a=b"}).text
