"""Calibrations of units, one a triad: which one counts, who decides, and that a coefficient is stored once."""

import json
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from datetime import UTC, datetime, timedelta
from typing import Any

import numpy as np
import pytest
import sqlalchemy as sa

from bench_service.campaigns.stores import Stores
from bench_service.model.calibrations import Act, Approval, Decider, StoredCalibration
from bench_service.model.errors import CalibrationRefused, IdempotencyConflict, NotFound
from bench_service.model.job import Job, JobState
from bench_service.model.records import Idempotency, StoredResult
from bench_service.persistence import Database
from bench_service.persistence.tables.columns import Table
from bench_service.wall_clock import new_id, now
from procedures.core.errors import DomainError
from procedures.core.limits import Verdict
from procedures.core.unit import Unit
from tests.kit.calibrations import document_of, triad

NewResult = Callable[..., StoredResult]
BO = Decider("Bo", "seen")


def current(stores: Stores, unit: str = "U-1") -> dict[str, str]:
    return {c.triad: c.id for c in stores.calibrations.current(unit)}


def made(stores: Stores, result: StoredResult) -> list[str]:
    return [c.id for c in stores.calibrations.of_results([result.id])]


def entered(name: str = "gyro", **changes: Any) -> StoredCalibration:
    given = StoredCalibration(
        id=new_id(),
        unit="U-1",
        value=triad(name, 7),
        method="entered",
        origin="passport 17",
        result_id=None,
        verdict=None,
        made_at=now(),
        simulated=False,
        current=False,
        by_rule=False,
        approval=Approval.OPEN,
        valid_from=now() - timedelta(days=1),
        valid_until=None,
    )
    return replace(given, **changes)


def test_each_triad_has_its_own_current_calibration(stores: Stores, new_result: NewResult) -> None:
    """Seen once: a whole-turns calibration, of the gyros alone, removed the accelerometers'."""
    both = stores.results.add(new_result(), [triad("gyro", 1), triad("accelerometer", 2)])
    turns = stores.results.add(new_result(), [triad("gyro", 3)])
    (gyro, accelerometer), (newer,) = made(stores, both), made(stores, turns)
    assert current(stores) == {"gyro": newer, "accelerometer": accelerometer}
    assert [c.id for c in stores.calibrations.list("U-1", triad="gyro").items] == [newer, gyro]
    assert [c.by_rule for c in stores.calibrations.several([gyro, newer])] == [False, True]


@pytest.mark.parametrize("verdict", [Verdict.FAIL, Verdict.ERROR])
def test_a_failed_calibration_never_becomes_current_by_itself(
    stores: Stores, new_result: NewResult, verdict: Verdict
) -> None:
    """Seen once: a failed calibration took over, and the next verification failed."""
    good = stores.results.add(new_result(), [triad("gyro", 1)])
    failed = stores.results.add(new_result(verdict=verdict), [triad("gyro", 2)])
    assert list(current(stores).values()) == made(stores, good)
    (failed_id,) = made(stores, failed)
    with pytest.raises(CalibrationRefused, match=rf"{failed_id}.*verdict is {verdict}.*remark"):
        stores.calibrations.choose("U-1", failed_id, Decider("Bo"))
    chosen = stores.calibrations.choose("U-1", failed_id, Decider("Bo", "the limit was wrong", proven=True))
    assert (chosen.current, chosen.by_rule) == (True, False)
    (decision,) = chosen.decisions
    assert (decision.act, decision.by, decision.proven, decision.remark) == (
        *(Act.CHOSEN, "Bo", True),
        "the limit was wrong",
    )


def test_a_unit_without_a_passed_calibration_has_none(stores: Stores, new_result: NewResult) -> None:
    stores.results.add(new_result(verdict=Verdict.FAIL), [triad("gyro")])
    assert current(stores) == {}


def test_a_second_analysis_joins_the_history_and_changes_nothing(stores: Stores, new_result: NewResult) -> None:
    first = stores.results.add(new_result(), [triad("gyro", 1)])
    again = stores.results.add(new_result(), [triad("gyro", 2)], by_rule=False)
    assert list(current(stores).values()) == made(stores, first)
    assert [c.result_id for c in stores.calibrations.list("U-1").items] == [again.id, first.id]


def test_a_persons_choice_stands_until_the_triad_is_given_back_to_the_rule(
    stores: Stores, new_result: NewResult, new_job: Callable[..., Job]
) -> None:
    def by_job(seed: int) -> str:
        job = stores.jobs.add(new_job())
        stores.jobs.transition(job.id, JobState.RUNNING, at=now())
        result = stores.results.add(new_result(job_id=job.id), [triad("gyro", seed)])
        stores.jobs.transition(job.id, JobState.SUCCEEDED, at=now(), verdict=Verdict.PASS, result_id=result.id)
        return made(stores, result)[0]

    first, second = by_job(1), by_job(2)
    stores.calibrations.choose("U-1", first, BO)
    third = by_job(3)
    assert current(stores) == {"gyro": first}
    method = stores.results.add(new_result(), [triad("gyro", 4)], by_rule=False)
    assert stores.calibrations.choose_by_rule("U-1", "gyro", BO).id == third, "a method's never comes by the rule"
    assert made(stores, method) != [third]
    assert current(stores) == {"gyro": third}
    assert stores.calibrations.get(third).by_rule
    stores.calibrations.reject("U-1", third, BO)
    assert stores.calibrations.choose_by_rule("U-1", "gyro", BO).id == second
    with pytest.raises(CalibrationRefused, match=r"no job that passed has given unit U-1 .* accelerometer"):
        stores.calibrations.choose_by_rule("U-1", "accelerometer", BO)


def test_a_rejected_calibration_is_not_used_and_gives_way_to_the_next(
    stores: Stores, new_result: NewResult, unit: Unit
) -> None:
    first = stores.results.add(new_result(), [triad("gyro", 1), triad("accelerometer", 2)])
    gyro = made(stores, first)[0]
    stores.calibrations.choose("U-1", gyro, BO)
    rejected = stores.calibrations.reject("U-1", gyro, Decider("Ann", "dropped on the floor"))
    assert (rejected.approval, rejected.current) == (Approval.REJECTED, True)
    known = stores.units.unit("U-1")
    with pytest.raises(DomainError, match=rf"U-1.*{gyro}.*rejected by Ann: dropped on the floor.*choose another"):
        known.calibration("gyro")
    assert known.known_matrix("gyro") is None
    assert known.calibration("accelerometer") is not None
    with pytest.raises(CalibrationRefused, match="rejected by Ann"):
        stores.calibrations.choose("U-1", gyro, BO)
    second = stores.results.add(new_result(), [triad("gyro", 3)])
    assert current(stores)["gyro"] == made(stores, second)[0], "a rejected choice does not stand"
    stores.calibrations.approve("U-1", gyro, BO, None)
    again = stores.calibrations.choose("U-1", gyro, BO)
    assert [d.act for d in again.decisions] == [
        *(Act.CHOSEN, Act.CHOSEN, Act.REJECTED),
        *(Act.APPROVED, Act.CHOSEN),
    ]


def test_an_expired_calibration_is_refused_until_it_is_approved_for_longer(stores: Stores, unit: Unit) -> None:
    ended = entered(valid_until=now() - timedelta(hours=1))
    with pytest.raises(CalibrationRefused, match=r"expired at .* UTC.*later valid_until"):
        stores.calibrations.add(ended, BO, choose=True)
    assert stores.calibrations.list("U-1").items == (), "refused as a whole"
    stores.calibrations.add(ended, BO, choose=False)
    stores.calibrations.approve("U-1", ended.id, BO, now() + timedelta(hours=1))
    stores.calibrations.choose("U-1", ended.id, BO)
    assert stores.units.unit("U-1").calibration_id("gyro") == ended.id
    stores.calibrations.approve("U-1", ended.id, BO, now() - timedelta(seconds=1))
    with pytest.raises(DomainError, match="expired"):
        stores.units.unit("U-1").required_calibration("gyro", "verify")
    early = entered(valid_from=now() + timedelta(days=1))
    with pytest.raises(CalibrationRefused, match="valid only from"):
        stores.calibrations.add(early, BO, choose=True)


def test_an_entered_calibration_comes_back_and_does_not_count_by_itself(stores: Stores, unit: Unit) -> None:
    given = entered()
    key = Idempotency("calibrations:k", "f")
    stored = stores.calibrations.add(given, BO, choose=False, idempotency=key)
    assert current(stores) == {}
    assert [(d.act, d.by, d.remark) for d in stored.decisions] == [(Act.ENTERED, "Bo", "seen")]
    assert stored.coefficients == given.coefficients, "to the last bit"
    np.testing.assert_allclose(stored.value.covariance_array, given.value.covariance_array, rtol=1e-14)
    assert stores.calibrations.add(entered(), BO, choose=False, idempotency=key).id == given.id
    with pytest.raises(IdempotencyConflict):
        stores.calibrations.add(entered(), BO, choose=False, idempotency=Idempotency("calibrations:k", "g"))
    assert stores.calibrations.choose("U-1", given.id, BO).current
    with pytest.raises(NotFound, match="unit U-2 has none"):
        stores.calibrations.choose("U-2", given.id, BO)


def test_of_many_calibrations_made_at_once_one_a_triad_is_current(stores: Stores, new_result: NewResult) -> None:
    def one(i: int) -> None:
        result = stores.results.add(new_result(), [triad("gyro", i), triad("accelerometer", i)])
        if i % 2:
            stores.calibrations.choose("U-1", made(stores, result)[0], BO)

    with ThreadPoolExecutor(4) as workers:
        list(workers.map(one, range(8)))
    history = stores.calibrations.list("U-1").items
    assert len(history) == 16
    assert sorted(c.triad for c in history if c.current) == ["accelerometer", "gyro"]


def test_a_coefficient_is_stored_once(stores: Stores, database: Database, new_result: NewResult) -> None:
    value = triad("gyro", 5)
    result = stores.results.add(new_result(document=document_of(value)), [value])
    with database.engine.connect() as connection:
        everything = json.dumps(
            [
                [str(cell) for cell in row]
                for table in Table.metadata.sorted_tables
                for row in connection.execute(sa.select(table))
            ]
        )
    for number in (*value.coefficients.tolist(), *value.standard_uncertainties.tolist()):
        assert everything.count(repr(number)) == 1
    back = stores.results.get(result.id).document
    assert list(back["triads"][0]["calibration"]) == list(result.document["triads"][0]["calibration"])
    assert back["triads"][0]["coefficients"] == result.document["triads"][0]["coefficients"]
    assert back["more"] == result.document["more"]
    found = back["triads"][0]["calibration"]
    assert (found["bias"], found["matrix"]) == (list(value.bias), [list(row) for row in value.matrix])
    np.testing.assert_allclose(found["covariance"], value.covariance_array, rtol=1e-14)
    with database.engine.connect() as connection:
        names = connection.scalars(sa.text("SELECT name FROM result_quantities")).all()
    assert names == ["gyro.asymmetry_x"]


def test_an_estimate_that_is_not_the_calibrations_own_stays_in_its_document(
    stores: Stores, new_result: NewResult
) -> None:
    document = document_of(triad("gyro", 5))
    result = stores.results.add(new_result(document=document), [triad("gyro", 6)])
    assert stores.results.get(result.id).document == document


def test_a_trend_reads_coefficients_where_they_are_stored(
    stores: Stores, new_result: NewResult, new_job: Callable[..., Job]
) -> None:
    values = [triad("gyro", seed) for seed in (1, 2)]
    for value in values:
        job = stores.jobs.add(new_job())
        stores.jobs.transition(job.id, JobState.RUNNING, at=now())
        result = stores.results.add(new_result(job_id=job.id, document=document_of(value)), [value])
        stores.jobs.transition(job.id, JobState.SUCCEEDED, at=now(), verdict=Verdict.PASS, result_id=result.id)
    for name in ("gyro.b_y", "/triads/0/coefficients/4/estimate", "/triads/0/calibration/bias/1"):
        found = stores.results.values("U-1", "static_run", name, simulated=True, limit=5)
        assert [v.quantity.value for v in found if v.quantity] == [v.bias[1] for v in values[::-1]], name


@pytest.fixture
def unit(stores: Stores) -> Unit:
    declared = Unit("U-1", 400.0, ())
    stores.units.put_unit(declared)
    return declared


def test_the_end_of_a_validity_is_exclusive() -> None:
    end = datetime(2031, 1, 1, tzinfo=UTC)
    assert "expired" in entered(valid_until=end, valid_from=end - timedelta(days=1)).unusable(end)
    assert not entered(valid_until=end, valid_from=end - timedelta(days=1)).unusable(end - timedelta(seconds=1))
