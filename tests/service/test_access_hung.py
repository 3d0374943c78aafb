"""With log-in on, and a Postgres that hangs: who asks is known from memory, so health and stop wait for no database."""

from collections.abc import Generator
from contextlib import suppress
from pathlib import Path
from threading import Thread, active_count

import httpx
import pytest

from bench_service.bench.stop.channel import StopChannel
from bench_service.wall_clock import monotonic_s, pause
from tests.chaos.databases import OwnPostgres, database
from tests.database_away import connections_that_wait, hung
from tests.kit.busy_machine import BUSY_S
from tests.kit.people import House, house

AFAR = {"X-Forwarded-For": "192.0.2.7"}
"""As a proxy on this host says for whom it asks: the request needs a proof."""
STOP = "/api/v1/benches/sim/stop"
IN_TIME_S = BUSY_S
"""A stop waits 1 s for the database, and up to 0.3 s for its entry; the rest is for a busy machine. A request that
waits for the database waits for as long as it hangs."""
FLOOD = 8
"""Stops in a row, as of a person who presses again and again, or of a program that does it by the thousand."""
CROWD = 60
"""Requests that hang in the database meanwhile: more than there are threads for requests (40)."""


@pytest.fixture(scope="module")
def postgres(tmp_path_factory: pytest.TempPathFactory) -> Generator[OwnPostgres]:
    with connections_that_wait(), database("postgres", tmp_path_factory.mktemp("own")) as made:
        assert isinstance(made, OwnPostgres)
        yield made


@pytest.fixture(scope="module")
def home(postgres: OwnPostgres, tmp_path_factory: pytest.TempPathFactory) -> Generator[House]:
    folder = tmp_path_factory.mktemp("hangs")
    with house(folder, database_url=postgres.url, device_folder=folder) as made:
        made.add_account("ada")
        yield made


def timed(client: httpx.Client, method: str, path: str, **more: object) -> tuple[httpx.Response, float]:
    begun_s = monotonic_s()
    answer = client.request(method, path, timeout=30, **more)  # pyright: ignore[reportArgumentType]
    return answer, monotonic_s() - begun_s


def read_in_vain(client: httpx.Client) -> None:
    """Read what is in the database, until the client is closed."""
    with suppress(httpx.HTTPError, RuntimeError):
        client.get("/api/v1/jobs", timeout=60)


def test_a_person_and_a_token_stop_and_see_health_while_everything_else_hangs(
    home: House, postgres: OwnPostgres
) -> None:
    senders = {"a token": home.program("eye", "viewer"), "a person": home.person("ada")}
    for client in senders.values():
        client.headers.update(AFAR)
        assert client.get("/api/v1/benches").status_code == 200
    unknown = home.client(Authorization="Bearer nobody-s-token")
    crowd = [home.client(**AFAR, Authorization=senders["a token"].headers["Authorization"]) for _ in range(CROWD)]
    with hung(postgres.data):
        waiting = [Thread(target=read_in_vain, args=(each,), daemon=True) for each in crowd]
        for thread in waiting:
            thread.start()
        pause(0.5)
        for who, client in senders.items():
            answer, took_s = timed(client, "GET", "/healthz")
            assert (answer.status_code, took_s < IN_TIME_S) == (200, True), (who, took_s)
            answer, took_s = timed(client, "POST", STOP, json={"reason": f"smoke, says {who}"})
            assert (answer.status_code, took_s < IN_TIME_S) == (202, True), (who, took_s, answer.text)
            assert answer.json()["books"], "the database follows later"
            known = {word.id: word.by for word in StopChannel(Path(home.settings.devices_in()), "sim").standing()}
            assert known[answer.json()["stop"]] == {"a token": "eye", "a person": "ada"}[who]
        answer, took_s = timed(unknown, "POST", STOP, json={"reason": "smoke, says somebody on this host"})
        assert (answer.status_code, took_s < IN_TIME_S) == (202, True), (took_s, answer.text)
        before = active_count()
        for number in range(FLOOD):
            answer, _ = timed(senders["a token"], "POST", STOP, json={"reason": f"flood {number}", "wait": False})
            assert answer.status_code == 202, answer.text
        assert active_count() - before < FLOOD / 2, "each stop leaves a thread that hangs"
        for refusal, path in ((401, STOP), (404, STOP.replace("sim", "nowhere")), (422, STOP)):
            sender = unknown if refusal == 401 else senders["a person"]
            headers = AFAR if refusal == 401 else {}
            answer, took_s = timed(sender, "POST", path, headers=headers, json={"by": 5} if refusal == 422 else {})
            assert answer.status_code == refusal or (refusal, answer.status_code) == (404, 503), answer.text
            assert took_s < IN_TIME_S, ("a refusal waits for a thread that hangs", refusal, took_s)
    for thread in waiting:
        thread.join(30)
    deadline_s = monotonic_s() + 30
    while len(stops := home.owner.get("/api/v1/benches/sim").json()["stops"]) < 3:
        assert monotonic_s() < deadline_s, stops
        pause(0.1)
    assert [stop["by"] for stop in stops[:3]] == ["eye", "ada", "127.0.0.1"]
