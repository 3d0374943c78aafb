"""Leases of manual mode in the store, on SQLite and on Postgres: who gets the bench, and what a key makes."""

from dataclasses import replace
from datetime import UTC, datetime, timedelta

import pytest

from bench_service.model.errors import IdempotencyConflict, ManualRefused, NotFound
from bench_service.model.manual import Answer, DemandState, ManualDemand, ManualLease
from bench_service.model.records import BenchStop, Idempotency
from bench_service.persistence.stores import Stores

NOW = datetime(2026, 11, 30, 8, 0, tzinfo=UTC)
LATER = NOW + timedelta(minutes=10)
LEASE = ManualLease("l1", "sim", "SIM-0001", "ann", False, "a look", NOW, LATER)
DEMAND = ManualDemand("d1", "l1", "k", "go_to", {"outer_deg": 5.0}, "ann", NOW)


def test_a_bench_has_one_open_lease(stores: Stores) -> None:
    assert stores.manual.begin(LEASE, Idempotency("manual:a", "f")) == LEASE
    assert stores.manual.begin(replace(LEASE, id="l2"), Idempotency("manual:a", "f")) == LEASE
    with pytest.raises(ManualRefused, match="in manual mode by ann until 2026-11-30T08:10"):
        stores.manual.begin(replace(LEASE, id="l2", holder="bob"))
    stores.manual.begin(replace(LEASE, id="l3", bench="annex"))
    assert stores.queue.look("sim", NOW).manual == LEASE
    stores.manual.end("l1", LATER, "over", True)
    assert stores.manual.open_on("sim") is None
    stores.manual.begin(replace(LEASE, id="l2", holder="bob"))


def test_a_stopped_bench_gives_none(stores: Stores) -> None:
    stores.benches.stop_bench_once(BenchStop("sim", NOW, "smoke", by="bob"))
    with pytest.raises(ManualRefused, match="is stopped"):
        stores.manual.begin(LEASE)


def test_one_worker_takes_it_and_not_after_its_time(stores: Stores) -> None:
    stores.manual.begin(LEASE)
    assert stores.manual.take("l1", LATER, "p") is None
    taken = stores.manual.take("l1", NOW, "p")
    assert taken is not None
    assert (taken.began_at, taken.process) == (NOW, "p")
    assert stores.manual.take("l1", NOW, "q") is None
    stores.manual.hear()
    assert stores.manual.news("l1").lease.heard == 1


def test_a_key_makes_one_demand_and_the_end_stops_what_is_open(stores: Stores) -> None:
    stores.manual.begin(LEASE)
    assert stores.manual.demand(DEMAND, NOW) == DEMAND
    assert stores.manual.demand(replace(DEMAND, id="d2"), NOW) == DEMAND
    with pytest.raises(IdempotencyConflict):
        stores.manual.demand(replace(DEMAND, id="d2", values={"outer_deg": 6.0}), NOW)
    with pytest.raises(ManualRefused, match="was over"):
        stores.manual.demand(replace(DEMAND, id="d3", key="late"), LATER)
    stores.manual.demand(replace(DEMAND, id="d4", key="done"), NOW)
    stores.manual.answer("d4", DemandState.DONE, Answer("at rest"), NOW)
    stores.manual.answer("d4", DemandState.STOPPED, Answer("too late"), NOW)
    assert [d.id for d in stores.manual.news("l1").demands] == ["d1"]
    stores.manual.end("l1", NOW, "over", True)
    stores.manual.end("l1", LATER, "again", False)
    assert stores.manual.get("l1").ended_because == "over"
    assert stores.manual.get_demand("l1", "k").state is DemandState.STOPPED
    assert stores.manual.get_demand("l1", "done").answer == Answer("at rest")
    with pytest.raises(NotFound):
        stores.manual.get_demand("l1", "none")
    with pytest.raises(ManualRefused, match="has ended: over"):
        stores.manual.renew("l1", LATER, NOW)


def test_an_end_that_is_asked_for_before_it_began_is_one_at_once(stores: Stores) -> None:
    stores.manual.begin(LEASE)
    ended = stores.manual.ask_end("l1", "bob", NOW)
    assert (ended.ended_because, ended.safe) == ("ended by bob before it began", None)


def test_a_lease_takes_no_demand_while_a_stop_stands_and_says_which(stores: Stores) -> None:
    stores.manual.begin(LEASE)
    stores.manual.demand(DEMAND, NOW)
    stores.benches.stop_bench_once(BenchStop("annex", NOW, "another bench", by="bob"))
    stores.manual.demand(replace(DEMAND, id="d2", key="before"), NOW)
    stores.benches.stop_bench_once(BenchStop("sim", NOW, "smoke", by="bob"))
    with pytest.raises(ManualRefused, match="bench sim is stopped: smoke; a person must look at it"):
        stores.manual.demand(replace(DEMAND, id="d3", key="after"), NOW)
    assert stores.manual.demand(DEMAND, NOW) == DEMAND  # a request that is repeated is answered as before
    (stop,) = stores.benches.standing_stops("sim")
    stores.benches.release_stop("sim", stop.id, NOW, "ann", "")
    stores.manual.demand(replace(DEMAND, id="d3", key="after"), NOW)
