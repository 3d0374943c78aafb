"""People whom a reverse proxy has authenticated: its word is taken from its own addresses, and from no other."""

from collections.abc import Generator

import httpx
import pytest

from bench_service.settings import BadSettings, Settings
from tests.kit.people import CSRF, House, house

HEADER = "X-Forwarded-User"
JOB = {"procedure": "no_operation", "unit": "SIM-0001"}


@pytest.fixture(scope="module")
def home(tmp_path_factory: pytest.TempPathFactory) -> Generator[House]:
    """127.0.0.1 is the proxy's address: what asks from 127.0.0.2 is somebody else."""
    settings = {"proxy_user_header": HEADER, "proxy_addresses": ("127.0.0.1/32",)}
    with house(tmp_path_factory.mktemp("proxy"), **settings) as made:
        made.add_account("ada")
        made.add_account("olga@lab.example", "operator", team="alpha", password=None)
        yield made


def from_elsewhere(home: House, **headers: str) -> httpx.Client:
    """A client with another address than the proxy's."""
    transport = httpx.HTTPTransport(local_address="127.0.0.2")
    return httpx.Client(base_url=home.url, headers=headers, transport=transport, timeout=60)


def test_the_proxys_person_has_the_role_and_team_of_the_account(home: House) -> None:
    for afar in ({}, {"X-Forwarded-For": "192.0.2.7"}):
        said = home.client(**{HEADER: "Olga@lab.example"}, **afar).get("/api/v1/session").json()
        assert (said["name"], said["role"], said["team"]) == ("olga@lab.example", "operator", "alpha")
        assert said["proof"] == "proxy"


def test_a_change_repeats_the_value_of_its_page(home: House) -> None:
    http = home.client(**{HEADER: "ada", "X-Forwarded-For": "192.0.2.7"})
    assert http.post("/api/v1/jobs", json=JOB).json()["type"] == "/problems/CsrfToken"
    csrf = http.get("/api/v1/session").json()["csrf"]
    assert f'content="{csrf}"' in http.get("/").text
    made = http.post("/api/v1/jobs", json=JOB, headers={CSRF: csrf})
    assert (made.status_code, made.json()["requested_by"]) == (202, "ada")
    olga = home.client(**{HEADER: "olga@lab.example"})
    assert olga.post("/api/v1/jobs", json=JOB, headers={CSRF: csrf}).json()["type"] == "/problems/CsrfToken"


def test_the_proxys_person_stops_from_a_page_without_scripts(home: House) -> None:
    http = home.client(**{HEADER: "olga@lab.example", "X-Forwarded-For": "192.0.2.7"})
    assert http.post("/benches/sim/stop", data={"reason": "by form"}).status_code == 200
    newest = home.owner.get("/api/v1/benches/sim/stops").json()["items"][0]
    assert (newest["reason"], newest["by"]) == ("by form", "olga@lab.example")
    nobody = home.client(**{"X-Forwarded-For": "192.0.2.7"})
    assert nobody.post("/benches/sim/stop", data={"reason": "by nobody"}).status_code == 401


def test_from_any_other_address_the_header_is_refused(home: House) -> None:
    with from_elsewhere(home, **{HEADER: "ada"}) as http:
        answer = http.get("/api/v1/jobs")
        assert (answer.status_code, answer.json()["type"]) == (403, "/problems/UntrustedProxy")
        assert http.get("/api/v1/session").json()["name"] is None
    with from_elsewhere(home, **{HEADER: "ada", "X-Forwarded-For": "127.0.0.1"}) as http:
        assert http.get("/api/v1/jobs").status_code == 403, "the socket's address counts, not what it says"


def test_a_person_without_an_account_or_two_names_are_refused(home: House) -> None:
    answer = home.client(**{HEADER: "mallory"}).get("/api/v1/jobs")
    assert (answer.status_code, answer.json()["type"]) == (403, "/problems/NoAccount")
    two = home.client().get("/api/v1/jobs", headers=[(HEADER, "olga@lab.example"), (HEADER, "ada")])
    assert two.status_code == 403


def test_an_account_of_the_proxy_alone_has_no_password_to_guess(home: House) -> None:
    http = home.client()
    for password in ("", "None", "null"):
        answer = http.post("/api/v1/session", json={"name": "olga@lab.example", "password": password})
        assert answer.status_code == 401


def test_header_and_addresses_are_given_together() -> None:
    for environ in (
        {"BENCH_PROXY_USER_HEADER": HEADER},
        {"BENCH_PROXY_ADDRESSES": "127.0.0.1"},
        {"BENCH_PROXY_USER_HEADER": HEADER, "BENCH_PROXY_ADDRESSES": "everywhere"},
        {"BENCH_PROXY_USER_HEADER": "a b", "BENCH_PROXY_ADDRESSES": "127.0.0.1"},
    ):
        with pytest.raises(BadSettings, match="BENCH_PROXY_"):
            Settings.from_environ(environ)
    found = Settings.from_environ({"BENCH_PROXY_USER_HEADER": HEADER, "BENCH_PROXY_ADDRESSES": "10.0.0.0/8, ::1"})
    assert found.proxy_addresses == ("10.0.0.0/8", "::1/128")
