"""The stop of a page without scripts: a plain form, answered with a page; and a stop that does not wait."""

from tests.service.client import Client
from tests.service.page import Page

BENCH = "/api/v1/benches/sim"


def released(client: Client) -> None:
    for stop in client.http.get(BENCH).json()["stops"]:
        said = {"by": "t", "remark": "t"}
        assert client.http.post(f"{BENCH}/stops/{stop['id']}/release", json=said).status_code == 200


def test_a_form_stops_the_bench_and_says_what_is_safe(sqlite_client: Client) -> None:
    answer = sqlite_client.http.post("/benches/sim/stop", data={"reason": "smoke", "by": "Олена"})
    assert answer.status_code == 200
    assert "The stop has arrived" in Page(answer.text).words
    assert "The devices are safe" in Page(answer.text).words
    (stop,) = sqlite_client.http.get(BENCH).json()["stops"]
    assert (stop["reason"], stop["by"]) == ("smoke", "Олена")
    released(sqlite_client)


def test_a_stop_that_is_refused_says_that_it_did_not_arrive(sqlite_client: Client) -> None:
    answer = sqlite_client.http.post("/benches/none/stop", data={})
    assert answer.status_code == 502
    assert "did NOT arrive" in Page(answer.text).words
    foreign = sqlite_client.http.post("/benches/sim/stop", data={}, headers={"Origin": "http://evil.example"})
    assert foreign.status_code == 403
    assert sqlite_client.http.get(BENCH).json()["stops"] == []


def test_a_stop_that_does_not_wait_is_answered_and_then_booked(sqlite_client: Client) -> None:
    stop = sqlite_client.http.post(f"{BENCH}/stop", json={"wait": False}).json()["stop"]
    while [one["id"] for one in sqlite_client.http.get(BENCH).json()["stops"]] != [stop]:
        pass
    released(sqlite_client)
