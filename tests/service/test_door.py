"""The door, over HTTP: what a page of another site sends changes nothing, whatever name resolves to our address."""

import socket
from collections.abc import Generator
from pathlib import Path

import httpx
import pytest
from starlette.datastructures import Headers

from bench_service.api.http.door import Door, is_loopback, is_loopback_address, may_listen
from bench_service.cli.asking.client import connect
from bench_service.cli.commands import run_command_line
from bench_service.cli.processes.serving import serving
from bench_service.model.errors import Misconfigured
from bench_service.settings import BadSettings, Settings
from tests.service.client import Client

TOKEN = "a-token-of-28-characters-abc"
BENCH = "/api/v1/benches/sim"


@pytest.fixture(scope="module")
def settings(tmp_path_factory: pytest.TempPathFactory) -> Settings:
    folder = tmp_path_factory.mktemp("door")
    (folder / "token").write_text(f"{TOKEN}\n")
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        port: int = probe.getsockname()[1]
    return Settings(
        database_url=f"sqlite:///{folder / 'bench.sqlite'}",
        port=port,
        hosts=("bench.example", "other.example:8443"),
        token_file=folder / "token",
    )


@pytest.fixture(scope="module")
def client(settings: Settings) -> Generator[Client]:
    with serving(settings), httpx.Client(base_url=f"http://127.0.0.1:{settings.port}", timeout=60) as http:
        yield Client(http)


LINK = {"Sec-Fetch-Site": "cross-site", "Sec-Fetch-Mode": "navigate", "Sec-Fetch-Dest": "document"}
FOREIGN_NAMES = (
    "evil.example",
    "evil.example:8000",
    "127.0.0.1.evil.example",
    "localhost.",
    "other.example",
    "x@localhost",
    "",
)
FOREIGN = {
    "a page elsewhere": {"Origin": "https://evil.example", "Sec-Fetch-Site": "cross-site"},
    "a page elsewhere, in an old browser": {"Origin": "https://evil.example"},
    "a sandboxed frame or a file": {"Origin": "null"},
    "a form without an origin": LINK,
    "another service of this host": {"Origin": "http://127.0.0.1:1", "Sec-Fetch-Site": "same-site"},
    "a neighbour's page": {"Sec-Fetch-Site": "same-site"},
    "a name that begins as ours": {"Origin": "http://127.0.0.1.evil.example"},
    "two origins": {"Origin": "http://127.0.0.1 https://evil.example"},
    "a new kind of page": {"Sec-Fetch-Site": "anything"},
}


@pytest.mark.parametrize("headers", FOREIGN.values(), ids=FOREIGN)
def test_a_form_of_another_site_changes_nothing(client: Client, headers: dict[str, str]) -> None:
    stop = client.http.post(f"{BENCH}/stop", json={"reason": "a person reaches into it"}).json()["stop"]
    job = client.submit("no_operation")["id"]
    stored, stops = client.stored(), client.http.get(f"{BENCH}/stops").json()
    asks = {
        f"{BENCH}/stop": {},
        f"{BENCH}/release": {},
        f"{BENCH}/stops/{stop}/release": {"data": {"by": "Bo", "remark": "looked"}},
        f"/api/v1/jobs/{job}/cancel": {},
        f"/api/v1/jobs/{job}/pause": {"content": "", "headers": {"Content-Type": "text/plain"}},
        "/api/v1/recordings": {"files": {"files": ("a.csv", b"gyro_x\n1\n")}, "data": {"description": "{}"}},
        "/api/v1/jobs": {"json": {"procedure": "no_operation", "unit": "SIM-0001"}},
    }
    for path, body in asks.items():
        sent = {**body, "headers": {**body.get("headers", {}), **headers}}
        answer = client.http.post(path, **sent)
        assert answer.status_code == 403, path
        assert answer.headers["content-type"] == "application/problem+json"
        assert answer.json()["type"] in ("/problems/ForeignOrigin", "/problems/ForeignSite")
    assert client.http.put("/api/v1/units/X-1", json={}, headers=headers).status_code == 403
    assert client.http.options(f"{BENCH}/stop", headers=headers).status_code == 403, "a preflight"
    assert client.http.get(f"{BENCH}/stops").json() == stops
    assert client.stored() == stored
    assert client.job(job)["state"] == "queued"
    client.http.post(f"{BENCH}/release").raise_for_status()
    client.wait(job)


@pytest.mark.parametrize("host", FOREIGN_NAMES)
def test_a_name_that_was_made_to_resolve_to_us_reads_and_does_nothing(client: Client, host: str) -> None:
    stops = client.http.get(f"{BENCH}/stops").json()
    for method, path in (("GET", "/"), ("GET", "/api/v1/jobs"), ("GET", "/api/v1/benches/"), ("POST", f"{BENCH}/stop")):
        answer = client.http.request(method, path, headers={"Host": host})
        assert (answer.status_code, answer.json()["type"]) == (421, "/problems/ForeignHost"), path
        assert "location" not in answer.headers
    assert client.http.get(f"{BENCH}/stops").json() == stops


def test_names_that_are_ours(client: Client, settings: Settings) -> None:
    local = ("localhost", f"LocalHost:{settings.port}", "[::1]:80")
    for host in (*local, "bench.example", "bench.example:1", "other.example:8443"):
        assert client.http.get("/healthz", headers={"Host": host}).status_code == 200, host


@pytest.mark.parametrize("lines", [b"", b"Host: localhost\r\nHost: evil.example\r\n"], ids=["no host", "two hosts"])
def test_a_request_speaks_to_one_name(client: Client, settings: Settings, lines: bytes) -> None:
    with socket.create_connection(("127.0.0.1", settings.port), timeout=30) as raw:
        raw.sendall(b"GET /healthz HTTP/1.0\r\n" + lines + b"\r\n")
        answer = raw.recv(1000)
    assert b" 421 " in answer.split(b"\r\n")[0]


def test_our_own_pages_and_programs_are_let_in(client: Client, settings: Settings) -> None:
    own = f"http://127.0.0.1:{settings.port}"
    cases = (
        {"Origin": own, "Sec-Fetch-Site": "same-origin"},
        {"Origin": own},
        {"Sec-Fetch-Site": "same-origin"},
        {"Sec-Fetch-Site": "none"},
        {"Host": "bench.example", "Origin": "https://bench.example"},
        {"Host": "bench.example:443", "Origin": "https://bench.example"},
        {"Host": "other.example:8443", "Origin": "https://other.example:8443"},
        {},
    )
    for headers in cases:
        assert client.http.post("/api/v1/jobs/none/cancel", headers=headers).status_code == 404, headers
    crossed = {"Host": "bench.example:444", "Origin": "https://bench.example"}
    assert client.http.post("/api/v1/jobs/none/cancel", headers=crossed).status_code == 403


def test_a_link_may_be_followed_from_elsewhere_and_nothing_embedded_or_fetched(client: Client) -> None:
    assert client.http.get("/", headers=LINK).status_code == 200
    for other in ({"Sec-Fetch-Dest": "iframe"}, {"Sec-Fetch-Dest": "image", "Sec-Fetch-Mode": "no-cors"}):
        assert client.http.get("/", headers={**LINK, **other}).status_code == 403
    fetched = {"Sec-Fetch-Site": "cross-site", "Sec-Fetch-Mode": "cors", "Origin": "https://evil.example"}
    answer = client.http.get("/api/v1/jobs", headers=fetched)
    assert answer.status_code == 403
    assert not [name for name in answer.headers if name.startswith("access-control")]


def test_from_elsewhere_a_program_needs_the_token(client: Client) -> None:
    """A proxy on this host says for whom it asks, and uvicorn takes its word: the address of the peer is that one."""
    afar = {"X-Forwarded-For": "192.0.2.7"}
    for given in (None, "", "Bearer", f"Bearer {TOKEN}x", f"Basic {TOKEN}", TOKEN):
        headers = {**afar, **({} if given is None else {"Authorization": given})}
        refused = client.http.get("/api/v1/jobs", headers=headers)
        assert (refused.status_code, refused.json()["type"]) == (401, "/problems/NoToken"), given
        assert refused.headers["www-authenticate"] == "Bearer"
        assert TOKEN not in refused.text
    for given in (f"Bearer {TOKEN}", f"bearer  {TOKEN}"):
        assert client.http.get("/api/v1/jobs", headers={**afar, "Authorization": given}).status_code == 200
    evil = {**afar, "Authorization": f"Bearer {TOKEN}", "Origin": "https://evil.example"}
    assert client.http.post(f"{BENCH}/stop", headers=evil).status_code == 403, "a token opens no foreign page's way"
    assert client.http.get("/api/v1/jobs").status_code == 200, "from here nobody needs one"


def test_commands_send_the_token_of_the_settings(settings: Settings) -> None:
    with connect(settings, "http://127.0.0.1:9", drive=False) as http:
        assert http.headers["Authorization"] == f"Bearer {TOKEN}"
    with connect(Settings(), "http://127.0.0.1:9", drive=False) as http:
        assert "Authorization" not in http.headers


def test_an_address_that_others_reach_needs_a_token(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    url = f"sqlite:///{tmp_path / 'bench.sqlite'}"
    for host in ("0.0.0.0", "::", "192.0.2.1", "no-such-name.invalid"):
        assert run_command_line(Settings(host=host, port=0, database_url=url), ["serve"]) == 2
        said = capsys.readouterr().err
        assert f"BENCH_HOST = {host}" in said
        assert (
            "a token that clients send with each request (`bench token add`, or one in the file BENCH_TOKEN_FILE),"
            in said
        )
    assert not (tmp_path / "bench.sqlite").exists()
    for host in ("127.0.0.1", "127.1.2.3", "::1", "localhost"):
        assert may_listen(Settings(host=host)), host
    assert may_listen(Settings(host="0.0.0.0", token_file=tmp_path / "token"))
    assert may_listen(Settings(host="0.0.0.0", published="loopback"))


def test_a_service_in_a_container_takes_what_its_published_port_brings() -> None:
    door = Door.of(Settings(host="0.0.0.0", published="loopback"))
    bridge, local = "172.18.0.1", Headers({"host": "localhost:8000"})
    assert door.refusal(local, "POST") is None
    assert door.is_local(bridge)
    assert not Door.of(Settings()).is_local(bridge)
    assert Door.of(Settings()).is_local("127.0.0.1")
    assert Door.of(Settings()).is_local(None), "over a socket file"
    refused = door.refusal(Headers({"host": "0.0.0.0:8000"}), "GET")
    assert refused is not None, "any address is nobody's name"
    assert refused.status == 421


@pytest.mark.parametrize("content", ["", "short", "two words-of-28-characters-ab", "ключ-ключ-ключ-ключ-ключ", None])
def test_a_token_that_cannot_be_used_is_refused_at_start(tmp_path: Path, content: str | None) -> None:
    file = tmp_path / "token"
    if content is not None:
        file.write_text(content)
    with pytest.raises(Misconfigured, match="BENCH_TOKEN_FILE"):
        Door.of(Settings(token_file=file))
    with pytest.raises(BadSettings):
        Settings(token_file=file).token()


def test_names_of_hosts_come_as_a_list_with_commas() -> None:
    found = Settings.from_environ({"BENCH_HOSTS": "bench.example, [fd00::1]:8000,"})
    assert found.hosts == ("bench.example", "[fd00::1]:8000")
    for wrong in ("*", "http://bench.example", "a b", "bench.example:port"):
        with pytest.raises(BadSettings, match="BENCH_HOSTS"):
            Settings.from_environ({"BENCH_HOSTS": wrong})
    with pytest.raises(BadSettings, match="BENCH_PUBLISHED"):
        Settings.from_environ({"BENCH_PUBLISHED": "everywhere"})


def test_which_addresses_are_loopback() -> None:
    addresses = ("127.0.0.1", "127.255.0.1", "::1", "::ffff:127.0.0.1")
    assert [is_loopback_address(text) for text in addresses] == [True] * 4
    others = ("128.0.0.1", "::", "::ffff:10.0.0.1", "localhost", "", "testclient", "127.0.0.1, 10.0.0.1")
    assert [is_loopback_address(text) for text in others] == [False] * 7
    assert [is_loopback(name) for name in ("localhost", "0.0.0.0", "", "no-such-name.invalid")] == [True, *[False] * 3]
