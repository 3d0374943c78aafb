"""Stops of a bench, each a thing of its own: how they stand, are released, and came over from an older database."""

from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from datetime import timedelta
from threading import Barrier

import pytest
import sqlalchemy as sa

from bench_service.campaigns.stores import Stores
from bench_service.model.errors import IllegalTransition, NotFound
from bench_service.model.job import Job
from bench_service.model.records import BenchStop, reasons_of
from bench_service.persistence import open_stores
from bench_service.persistence.database import connect
from tests.storage.conftest import NOW
from tests.storage.migrating import migrated

LATER = timedelta(minutes=1)


def stopped(stores: Stores, *reasons: str, bench: str = "sim") -> list[BenchStop]:
    """Stops for these reasons, a minute apart."""
    stops = [BenchStop(bench, NOW + k * LATER, reason, by=f"person {k}") for k, reason in enumerate(reasons)]
    for stop in stops:
        stores.benches.stop_bench(stop)
    return stops


def test_a_bench_works_again_only_when_none_of_its_stops_stands(stores: Stores, new_job: Callable[..., Job]) -> None:
    job = stores.jobs.add(new_job())
    smoke, reach = stopped(stores, "smoke", "I reach into it")
    (other,) = stopped(stores, "lunch", bench="sim-2")
    assert stores.benches.standing_stops("sim") == (smoke, reach)
    place = stores.queue.look("sim", NOW).place(job.id, True)
    assert place is not None
    assert place.waiting == "bench sim is stopped: smoke; I reach into it"
    released = stores.benches.release_stop("sim", smoke.id, NOW + 5 * LATER, "Bo", "the fan was dusty")
    assert (released.released_at, released.released_by, released.remark) == (NOW + 5 * LATER, "Bo", "the fan was dusty")
    assert (released.stands, reach.stands) == (False, True)
    assert stores.benches.bench_stop("sim") == reach
    assert stores.queue.look("sim", NOW).next() is None
    assert stores.queue.front("sim", NOW).next() is None
    stores.benches.release_stop("sim", reach.id, NOW, "person 1", "done")
    assert stores.benches.bench_stop("sim") is None
    assert stores.queue.look("sim", NOW).next() is not None
    assert stores.benches.standing_stops("sim-2") == (other,)


def test_the_history_keeps_every_stop(stores: Stores) -> None:
    made = stopped(stores, *"abcde")
    stopped(stores, "of another bench", bench="sim-2")
    for stop in made[:3]:
        stores.benches.release_stop("sim", stop.id, NOW + LATER, "Bo", f"after {stop.reason}")
    first = stores.benches.stops("sim", limit=3)
    rest = stores.benches.stops("sim", after=first.next, limit=3)
    listed = [*first.items, *rest.items]
    assert [stop.id for stop in listed] == sorted((stop.id for stop in made), reverse=True)
    assert rest.next is None
    assert {stop.reason: stop.remark for stop in listed} == {
        "a": "after a",
        "b": "after b",
        "c": "after c",
        "d": "",
        "e": "",
    }


def test_a_release_repeated_changes_nothing_and_another_persons_is_refused(stores: Stores) -> None:
    (stop,) = stopped(stores, "smoke")
    first = stores.benches.release_stop("sim", stop.id, NOW, "Bo", "looked")
    assert stores.benches.release_stop("sim", stop.id, NOW + LATER, "Bo", "looked") == first
    for by, remark in (("Al", "looked"), ("Bo", "looked again")):
        with pytest.raises(IllegalTransition, match=r"was released before, at 2031-05-06T07:08:09\.123456.* by Bo"):
            stores.benches.release_stop("sim", stop.id, NOW, by, remark)
    assert stores.benches.stops("sim").items == (first,)


def test_a_stop_of_another_bench_or_of_none_is_not_found(stores: Stores) -> None:
    (stop,) = stopped(stores, "smoke")
    for bench, name in (("sim-2", stop.id), ("sim", "none")):
        with pytest.raises(NotFound):
            stores.benches.release_stop(bench, name, NOW, "Bo", "looked")
    assert stores.benches.bench_stop("sim") == stop


def test_a_stop_noted_again_is_the_same_stop(stores: Stores) -> None:
    """The word of a stop can reach the database twice, from the process that took it and from the supervisor."""
    (stop,) = stopped(stores, "smoke")
    stores.benches.stop_bench(stop)
    assert stores.benches.standing_stops("sim") == (stop,)
    stores.benches.release_stop("sim", stop.id, NOW, "Bo", "looked")
    stores.benches.stop_bench(stop)
    assert stores.benches.bench_stop("sim") is None


def test_the_service_that_tries_again_stops_a_bench_once(stores: Stores) -> None:
    for k in range(3):
        stores.benches.stop_bench_once(BenchStop("sim", NOW + k * LATER, "could not be made safe: silence"))
    stores.benches.stop_bench_once(BenchStop("sim", NOW, "could not be made safe: smoke"))
    assert len(stores.benches.standing_stops("sim")) == 2
    for stop in stores.benches.standing_stops("sim"):
        stores.benches.release_stop("sim", stop.id, NOW, "Bo", "looked")
    stores.benches.stop_bench_once(BenchStop("sim", NOW, "could not be made safe: silence"))
    assert len(stores.benches.standing_stops("sim")) == 1, "a fault after the release stops the bench anew"


def test_of_two_people_who_release_a_stop_at_once_one_does(stores: Stores) -> None:
    for _ in range(8):
        (stop,) = stopped(stores, "smoke")
        at_once = Barrier(2)

        def release(who: str, stop: BenchStop = stop, together: Barrier = at_once) -> bool:
            together.wait(20)
            try:
                stores.benches.release_stop("sim", stop.id, NOW, who, "looked")
            except IllegalTransition:
                return False
            return True

        with ThreadPoolExecutor(2) as people:
            won = dict(zip(("Al", "Bo"), people.map(release, ("Al", "Bo")), strict=True))
        assert sum(won.values()) == 1
        kept = next(found for found in stores.benches.stops("sim").items if found.id == stop.id)
        assert won[kept.released_by]


def test_a_sentence_names_each_reason_once_and_only_a_few() -> None:
    stops = [BenchStop("sim", NOW, reason) for reason in ("a", "b", "a", "c", "d", "e")]
    assert reasons_of(stops[:3]) == "a; b"
    assert reasons_of(stops) == "a; b; c (and 2 more reasons)"


def test_stops_of_an_older_database_stand_after_the_upgrade(database_url: str) -> None:
    database = connect(database_url)
    migrated(database, "0006")
    moments = [sa.bindparam(name, type_=sa.DateTime(timezone=True)) for name in ("at", "safe_at")]
    columns = ("bench", "at", "reason", "safe_at", "safe_by")
    values = ", ".join(f":{name}" for name in columns)
    old = sa.text(f"INSERT INTO bench_stops ({', '.join(columns)}) VALUES ({values})").bindparams(*moments)
    with database.write_connection() as connection:
        connection.execute(
            old, {"bench": "east", "at": NOW, "reason": "smoke", "safe_at": NOW + LATER, "safe_by": "Bo"}
        )
        connection.execute(old, {"bench": "west", "at": NOW + LATER, "reason": "lunch", "safe_at": None, "safe_by": ""})
    migrated(database, "0007")
    stores, again = open_stores(database_url)
    (east,), (west,) = stores.benches.standing_stops("east"), stores.benches.standing_stops("west")
    assert (east.at, east.reason, east.safe_at, east.safe_by) == (NOW, "smoke", NOW + LATER, "Bo")
    assert (west.at, west.reason, west.safe_at) == (NOW + LATER, "lunch", None)
    assert east.id < west.id, "ids sort by the time of the stop"
    stores.benches.release_stop("west", west.id, NOW, "Bo", "back")
    later = BenchStop("east", NOW + 9 * LATER, "later")
    stores.benches.stop_bench(later)
    again.dispose()
    migrated(database, "0006")
    with database.engine.connect() as connection:
        kept = connection.execute(sa.text("SELECT bench, reason FROM bench_stops")).all()
    assert [tuple(row) for row in kept] == [("east", "smoke")], "the oldest of each bench that stands"
    database.dispose()
