"""A quantity over a unit's results on both databases: which results count, and that no document is read for it."""

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import pytest
import sqlalchemy as sa
from alembic import command
from alembic.config import Config

from bench_service.campaigns.stores import Stores
from bench_service.evidence.trend import trend_of
from bench_service.model.job import Job, JobState
from bench_service.model.quantities import Quantity
from bench_service.model.records import StoredResult
from bench_service.persistence import Database, open_stores
from bench_service.persistence.database import connect
from bench_service.persistence.migration import SCRIPTS
from procedures.core.limits import Verdict
from tests.storage.campaigns import NOW, Laboratory, campaign, new_run, value_check

KEPT = {"simulated": True, "limit": 100}


@pytest.fixture
def judged(
    stores: Stores, new_job: Callable[..., Job], new_result: Callable[..., StoredResult]
) -> Callable[..., StoredResult]:
    """A job's result that gave it its verdict, with a check "bias"; anything may be said otherwise."""

    def make(bias: float, unit: str = "deg/h", **changes: Any) -> StoredResult:
        job = stores.jobs.add(new_job())
        stores.jobs.transition(job.id, JobState.RUNNING, at=NOW)
        document = {"checks": [value_check("bias", bias, unit)], "fit": {"steps": [bias, 7]}}
        result = stores.results.add(replace(new_result(job_id=job.id, document=document), **changes))
        stores.jobs.transition(job.id, JobState.SUCCEEDED, at=NOW, verdict=Verdict.PASS, result_id=result.id)
        return result

    return make


def values(stores: Stores, quantity: str = "bias", **more: Any) -> list[float | None]:
    found = stores.results.values("U-1", "static_run", quantity, **{**KEPT, **more})
    return [None if one.quantity is None else one.quantity.value for one in found]


def test_only_results_that_gave_a_verdict_count(
    stores: Stores, judged: Callable[..., StoredResult], new_result: Callable[..., StoredResult]
) -> None:
    first = judged(1.0)
    judged(2.0, simulated=False)
    judged(3.0, name="noise")
    stores.results.add(new_result(job_id=first.job_id, document={"checks": [value_check("bias", 4.0)]}))
    last = judged(5.0)
    assert values(stores) == [5.0, 1.0]
    assert values(stores, simulated=False) == [2.0]
    assert values(stores, before=last.id) == [1.0]
    assert values(stores, limit=1) == [5.0]
    assert stores.results.newest_verdict("U-1", "static_run", simulated=True) == last
    assert stores.results.newest_verdict("U-2", "static_run", simulated=True) is None


def test_results_of_another_plan_do_not_use_up_the_number_that_is_wanted(
    stores: Stores, judged: Callable[..., StoredResult]
) -> None:
    for bias in (1.0, 2.0, 3.0):
        judged(bias)
        for _ in range(30):
            judged(-bias, parameters={"record_s": 5.0})
    plan = {"record_s": 60.0}
    assert values(stores, limit=2, parameters=plan) == [3.0, 2.0]
    assert values(stores, parameters=plan) == [3.0, 2.0, 1.0]


def test_a_named_value_and_a_pointer_say_the_same(stores: Stores, judged: Callable[..., StoredResult]) -> None:
    results = [judged(bias) for bias in (1.0, 1e-300, -0.1)]
    judged(9.0, document={"fit": {"steps": []}})
    assert (
        values(stores)
        == values(stores, "/fit/steps/0")
        == values(stores, "/checks/0/value")
        == [None, -0.1, 1e-300, 1.0]
    )
    (newest, *_) = stores.results.values("U-1", "static_run", "bias", before=results[-1].id, **KEPT)
    assert newest.quantity == Quantity("bias", 1e-300, "deg/h", None)
    assert (newest.result, newest.job) == (results[1].id, results[1].job_id)
    assert newest.at == results[1].created_at


def test_named_values_are_found_without_a_document(
    stores: Stores, judged: Callable[..., StoredResult], database: Database
) -> None:
    judged(1.0)
    with database.write_connection() as connection:
        connection.execute(sa.text("UPDATE results SET document = '{}'"))
    assert values(stores) == [1.0]
    assert values(stores, "/fit/steps/0") == [None]


def test_a_chart_begins_anew_where_the_unit_changed(stores: Stores, judged: Callable[..., StoredResult]) -> None:
    for bias, unit in ((1.0, "deg/h"), (1.1, "deg/h"), (2.0, "rad/s"), (2.1, "rad/s")):
        judged(bias, unit)
    found = stores.results.values("U-1", "static_run", "bias", **KEPT)[::-1]
    trend = trend_of(found, "U-1", "static_run", "bias")
    assert ([p.value for p in trend.points], trend.unit, trend.without) == ([2.0, 2.1], "rad/s", 2)
    judged_last = trend_of(found, "U-1", "static_run", "bias", judged=1)
    assert (len(judged_last.points), judged_last.limits) == (2, None)


def test_a_quantity_that_earlier_results_lack_is_judged_once_there_are_enough(
    stores: Stores, new_job: Callable[..., Job]
) -> None:
    laboratory = Laboratory(stores, new_job)
    of = campaign({"trends": [{"quantity": "drift", "at_least": 2, "outcome": "fail"}]})
    said: list[tuple[Verdict | None, list[str]]] = []
    for name in ("bias", "bias", "drift", "drift", "drift"):
        run = new_run(of)
        laboratory.stores.campaigns.add_run(run)
        conductor = laboratory.conductor()
        conductor.advance(run.id)
        laboratory.end(laboratory.jobs()[-1], checks=[value_check(name, 1.0 + 0.1 * len(said))])
        conductor.advance(run.id)
        run = laboratory.stores.campaigns.run(run.id)
        said.append((run.verdict, list(run.steps[0].warnings)))
    needed = "trend of drift: {} earlier results, 2 are needed to judge it"
    assert said == [
        (Verdict.ERROR, []),  # its own result lacks it
        (Verdict.ERROR, []),
        (Verdict.PASS, [needed.format(0)]),
        (Verdict.PASS, [needed.format(1)]),
        (Verdict.PASS, []),
    ]


def test_results_from_before_their_numbers_were_kept_are_in_a_trend_too(
    database_url: str, stores: Stores, judged: Callable[..., StoredResult], new_result: Callable[..., StoredResult]
) -> None:
    many = 120  # more than a migration has in memory at a time
    for bias in (1.0, 2.0):
        judged(bias)
    for k in range(many):
        estimate = {"name": "gyro.b_x", "unit": "rad/s", "estimate": float(k), "standard_uncertainty": 0.5}
        stores.results.add(new_result(document={"estimates": [[estimate]]}))
    database = connect(database_url)
    before = _quantities(database)
    assert len(before) == 2 + many
    config = Config()
    config.set_main_option("script_location", str(SCRIPTS))
    with database.write_connection() as connection:
        config.attributes["connection"] = connection
        command.downgrade(config, "0004")
        assert not sa.inspect(connection).has_table("result_quantities")
    open_stores(database_url)[1].dispose()
    assert _quantities(database) == before
    database.dispose()
    assert values(stores) == [2.0, 1.0]


def _quantities(database: Database) -> list[tuple[Any, ...]]:
    with database.write_connection() as connection:
        rows = connection.execute(sa.text("SELECT * FROM result_quantities ORDER BY result_id, name"))
        return [tuple(row) for row in rows]
