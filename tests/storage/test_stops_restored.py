"""A database restored from a copy that is older than a stop: the stop is in the device folder, and goes on standing."""

from concurrent.futures import ThreadPoolExecutor
from datetime import timedelta
from pathlib import Path
from threading import Barrier

import pytest

from bench_service.bench.records_in_place import RECORD_BYTES
from bench_service.bench.stop.channel import StopChannel
from bench_service.bench.stop.exchange import StopExchange
from bench_service.bench.stop.word import DAMAGED, StopWord
from bench_service.bench_files import _Books
from bench_service.campaigns.stores import Stores
from bench_service.jobs.stop_entry import RESTORED
from bench_service.persistence import open_stores
from bench_service.persistence.bench.safety_books import SqlSafetyBooks
from bench_service.wall_clock import now


@pytest.fixture
def channel(tmp_path: Path) -> StopChannel:
    made = StopChannel(tmp_path / "devices", "sim")
    made.prepare()
    return made


def exchange(channel: StopChannel, stores: Stores) -> StopExchange:
    """The exchange of a process that begins now."""
    return StopExchange(StopChannel(channel._folder, "sim"), _Books(stores, "sim"))


def booked_elsewhere(channel: StopChannel, tmp_path: Path, *words: StopWord) -> None:
    """Stops that the database of before the restoration had."""
    before, database = open_stores(f"sqlite:///{tmp_path / 'before.sqlite'}")
    for word in words:
        assert channel.ask(word)
    exchange(channel, before).exchange()
    assert all(word.booked for word in channel.standing())
    assert {stop.id for stop in before.benches.standing_stops("sim")} == {word.id for word in words}
    database.dispose()


def test_a_stop_that_a_restored_database_does_not_know_stands_until_a_person_releases_it(
    channel: StopChannel, stores: Stores, tmp_path: Path
) -> None:
    word = StopWord("smoke", "Olena", "command", at=now() - timedelta(hours=1))
    booked_elsewhere(channel, tmp_path, word)
    for _ in range(3):  # by a process that goes on, and once more by one that is started anew
        exchange(channel, stores).exchange()
        assert [one.id for one in channel.standing()] == [word.id]
    (stop,) = stores.benches.standing_stops("sim")
    assert (stop.id, stop.by, stop.at) == (word.id, "Olena", word.at)
    assert stop.reason == f"smoke ({RESTORED})"
    (noted,) = [one for one in stores.audit.list().items if one.action == "stop"]
    assert (noted.id, noted.who) == (word.id, "Olena")
    assert noted.detail["text"].startswith(RESTORED)
    assert noted.detail["via"] == "command"
    stores.benches.release_stop("sim", word.id, now(), "Bo", "looked")
    exchange(channel, stores).exchange()
    assert channel.standing() == ()


def test_a_released_stop_never_comes_back_and_its_row_is_never_deleted(channel: StopChannel, stores: Stores) -> None:
    word = StopWord("smoke", "Olena", "http")
    assert channel.ask(word)
    running = exchange(channel, stores)
    running.exchange()
    stores.benches.release_stop("sim", word.id, now(), "Bo", "looked")
    for one in (running, exchange(channel, stores)):
        one.exchange()
        assert channel.standing() == ()
    assert stores.benches.standing_stops("sim") == ()
    old = StopWord("smoke", "Olena", "http", word.id, word.at, booked=True)
    assert channel.ask(old), "as a device folder that was restored brings it back"
    running.exchange()
    assert channel.standing() == ()
    assert [stop.stands for stop in stores.benches.stored_stops([word.id])] == [False]


def test_worker_and_supervisor_that_find_it_missing_at_once_enter_it_once(
    channel: StopChannel, stores: Stores, database_url: str, tmp_path: Path
) -> None:
    words = [StopWord(f"reason {k}", "Olena", "http") for k in range(4)]
    booked_elsewhere(channel, tmp_path, *words)
    supervisor = SqlSafetyBooks(database_url, "sim")
    both = [exchange(channel, stores), StopExchange(StopChannel(channel._folder, "sim"), supervisor)]
    at_once = Barrier(2)

    def run(one: StopExchange) -> None:
        at_once.wait(20)
        for _ in range(3):
            one.exchange()

    with ThreadPoolExecutor(2) as processes:
        list(processes.map(run, both))
    supervisor.close()
    ids = {word.id for word in words}
    assert {stop.id for stop in stores.benches.standing_stops("sim")} == ids == {w.id for w in channel.standing()}
    assert sorted(one.id for one in stores.audit.list().items if one.action == "stop") == sorted(ids)


def test_an_unreadable_record_becomes_a_stop_that_a_person_releases(channel: StopChannel, stores: Stores) -> None:
    """It was removed at the first comparison: no database ever has a stop named "damaged"."""
    for _ in range(2):  # a second damage is another stop
        channel.ask(StopWord("a test", "somebody", "http"))
        with (channel._folder / "bench-sim.stop").open("r+b") as file:
            file.seek(2 * RECORD_BYTES)
            file.write(b"xxxxxxxx")
        for one in (exchange(channel, stores), exchange(channel, stores)):
            one.exchange()
        (word,) = channel.standing()
        (stop,) = stores.benches.standing_stops("sim")
        assert (stop.id, stop.reason) == (word.id, DAMAGED.reason)
        stores.benches.release_stop("sim", stop.id, now(), "Bo", "looked")
        exchange(channel, stores).exchange()
        assert channel.standing() == ()
