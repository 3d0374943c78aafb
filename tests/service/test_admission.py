"""Heavy requests are admitted within bounds: more of them are refused with 503 and Retry-After, or wait their turn."""

import asyncio
from threading import Event, Timer

import pytest

from bench_service.api import recordings
from bench_service.api.http import admitted_stream
from bench_service.evidence import admission
from bench_service.evidence.admission import Places, Turns
from bench_service.model.errors import Overloaded
from tests.service.client import Client


def test_places_are_bounded_by_number_and_memory_and_given_back_once() -> None:
    places = Places("exports", most=2, most_bytes=100)
    first = places.take(90)
    with pytest.raises(Overloaded, match="1 exports are running already"):
        places.take(20)
    second = places.take(10)
    with pytest.raises(Overloaded):
        places.take(0)
    first()
    first()
    places.take(90)
    with pytest.raises(Overloaded):
        places.take(0)
    second()


def test_one_that_wants_more_than_there_is_gets_its_place_alone() -> None:
    places = Places("exports", most=2, most_bytes=100)
    alone = places.take(1000)
    with pytest.raises(Overloaded):
        places.take(1)
    alone()
    places.take(1)


def test_a_machine_without_memory_takes_none(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(admission, "available_bytes", lambda: admission.SPARE_BYTES)
    with pytest.raises(Overloaded, match="too little free memory"):
        Places("exports", most=2, most_bytes=100).take(1)


def test_the_machine_says_how_much_memory_it_has() -> None:
    found = admission.available_bytes()
    assert found is None or 1_000_000 < found < 1 << 50


def test_turns_run_a_few_at_a_time_and_refuse_what_would_wait_too_long() -> None:
    held, running = Event(), list[int]()

    def work(number: int) -> int:
        running.append(number)
        assert held.wait(10)
        return number

    async def crowd() -> list[object]:
        turns = Turns("previews", at_once=2, waiting=3)
        tasks = [asyncio.create_task(turns.run(work, number)) for number in range(7)]
        while len(running) < 2:
            await asyncio.sleep(0.01)
        await asyncio.sleep(0.05)
        assert len(running) == 2
        held.set()
        found = await asyncio.gather(*tasks, return_exceptions=True)
        assert await turns.run(work, 9) == 9  # every place was given back
        return found

    found = asyncio.run(crowd())
    assert sorted(each for each in found if isinstance(each, int)) == [0, 1, 2, 3, 4]
    assert [type(each) for each in found[5:]] == [Overloaded, Overloaded]


def test_an_export_beyond_the_places_is_refused_and_may_be_sent_again(
    sqlite_client: Client, monkeypatch: pytest.MonkeyPatch
) -> None:
    job = sqlite_client.wait(sqlite_client.submit()["id"])
    recording = sqlite_client.recordings(job["id"])[0]["id"]
    places = Places("exports", most=1, most_bytes=10**9)
    monkeypatch.setattr(recordings, "EXPORTS", places)
    monkeypatch.setattr(admitted_stream, "WAIT_S", 0.2)
    other = places.take(1)
    refused = sqlite_client.http.get(f"/api/v1/recordings/{recording}/data")
    assert (refused.status_code, refused.headers["Retry-After"]) == (503, "2")
    monkeypatch.setattr(admitted_stream, "WAIT_S", 10.0)
    Timer(0.3, other).start()  # now it waits for its turn
    for _ in range(3):  # each gives its place back, a refused one too
        assert sqlite_client.http.get(f"/api/v1/recordings/{recording}/data").status_code == 200
        assert sqlite_client.http.get(f"/api/v1/recordings/{recording}/data?channels=none").status_code == 422
    places.take(10**9)()
