"""The upgrade from the tables before calibrations had a triad each: what is stored is carried over, numbers and all.

A unit has three old calibrations: both triads by a job that passed (a), the same by a second analysis (b), and the
gyros alone by a whole-turns job (c), which was current: it had removed the accelerometers'. A verification rests on a.
"""

import json
from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
import sqlalchemy as sa
from pydantic import TypeAdapter
from pydantic_core import to_jsonable_python

from bench_service.campaigns.stores import Stores
from bench_service.model.context import context_document, context_of, withheld_calibration
from bench_service.model.job import Job, JobState
from bench_service.persistence import Database, open_stores
from procedures.bench.description import AxisLimits, BenchDescription, TableAccuracy
from procedures.core.imu_model import TriadCalibration
from procedures.core.limits import Verdict
from procedures.core.site import Site
from procedures.core.unit import Unit, Withheld
from procedures.procedure import Context
from tests.kit.calibrations import document_of, triad
from tests.kit.procedures import simulated_context
from tests.storage.conftest import NOW
from tests.storage.migrating import migrated

BOTH = (triad("gyro", 1), triad("accelerometer", 2))
AGAIN = (triad("gyro", 3), triad("accelerometer", 4))
TURNS = (triad("gyro", 5),)
AXIS = AxisLimits(-180.0, 180.0, 200.0, 500.0)
BENCH = BenchDescription("sim", Site(55.0, 9.81, 37.0), AXIS, AXIS, AXIS, TableAccuracy(1.0, 2.0, 3.0), True)


def insert(connection: sa.Connection, table: str, **values: Any) -> None:
    columns = ", ".join(f'"{name}"' for name in values)
    names = ", ".join(f":{name}" for name in values)
    moments = [sa.bindparam(name, type_=sa.DateTime(timezone=True)) for name in values if name.endswith("_at")]
    connection.execute(sa.text(f"INSERT INTO {table} ({columns}) VALUES ({names})").bindparams(*moments), values)


def old_context(used: str | None, values: tuple[TriadCalibration, ...]) -> dict[str, Any]:
    """A job's context as it was stored: with the calibrations in use, coefficients and all."""
    document = TypeAdapter(Context).dump_python(
        Context(Unit("U-1", 400.0, (), calibrations=values), BENCH), mode="json"
    )
    unit = {k: v for k, v in document["unit"].items() if k not in ("calibration_ids", "withheld")}
    return {**document, "unit": {**unit, "calibration_id": used}}


def old_document(values: tuple[TriadCalibration, ...]) -> dict[str, Any]:
    triads = [document_of(v)["triads"][0] for v in values]
    for one in triads:  # the accelerometers' coefficients have other units than the shared sample says
        one["coefficients"] = one["coefficients"] if one["calibration"]["triad"] == "gyro" else []
    plain = {"name": "plain", "unit": "1", "estimate": 0.5, "standard_uncertainty": None}
    return {"triads": triads, "checks": [], "more": [plain]}


def add_result(connection: sa.Connection, which: str, job: str, context: dict[str, Any], **about: Any) -> None:
    given = {"document": {"checks": []}, "name": "verification_9_orientations", **about}
    insert(
        connection,
        "results",
        id=f"result-{which}",
        kind="procedure",
        version="1",
        parameters="{}",
        verdict="pass",
        code_version="abc",
        simulated=True,
        created_at=NOW,
        unit="U-1",
        job_id=job,
        seed=3,
        context=json.dumps(context),
        **{**given, "document": json.dumps(given["document"])},
    )


def add_calibration(
    connection: sa.Connection, name: str, values: tuple[TriadCalibration, ...], current: bool = False
) -> None:
    document = old_document(values)
    numbers = [row for one in document["triads"] for row in one["coefficients"]] + document["more"]
    for row in numbers:
        number = {"value": row["estimate"], "unit": row["unit"], "standard_uncertainty": row["standard_uncertainty"]}
        insert(connection, "result_quantities", result_id=f"result-{name}", name=row["name"], **number)
    insert(
        connection,
        "calibrations",
        id=f"calibration-{name}",
        unit="U-1",
        result_id=f"result-{name}",
        made_at=NOW,
        is_current=current,
        triads=json.dumps(to_jsonable_python(values)),
        simulated=True,
    )


@pytest.fixture
def upgraded(
    stores: Stores, database: Database, database_url: str, new_job: Callable[..., Job]
) -> tuple[Stores, dict[str, str]]:
    """A database of revision 0007 with real rows, opened by today's service; and its jobs."""
    stores.units.put_unit(Unit("U-1", 400.0, ()))
    contexts = {
        "calibration": old_context(None, ()),
        "turns": old_context("calibration-a", BOTH),
        "verification": old_context("calibration-a", BOTH),
    }
    jobs = {}
    for name, context in contexts.items():
        job = stores.jobs.add(new_job(context=context))
        stores.jobs.transition(job.id, JobState.RUNNING, at=NOW)
        jobs[name] = job.id
    migrated(database, "0007")
    with database.write_connection() as connection:
        for name, job, values in (("a", "calibration", BOTH), ("b", "calibration", AGAIN), ("c", "turns", TURNS)):
            add_result(connection, name, jobs[job], contexts[job], document=old_document(values), name="static_run")
            add_calibration(connection, name, values, current=name == "c")
        add_result(connection, "d", jobs["verification"], contexts["verification"])
        insert(connection, "result_calibrations", result_id="result-d", position=0, calibration_id="calibration-a")
        for job, result in (("calibration", "a"), ("turns", "c"), ("verification", "d")):
            connection.execute(
                sa.text("UPDATE jobs SET result_id = :result, verdict = 'pass', state = 'succeeded' WHERE id = :job"),
                {"result": f"result-{result}", "job": jobs[job]},
            )
    open_stores(database_url)[1].dispose()
    return stores, jobs


def assert_value(found: TriadCalibration, expected: TriadCalibration) -> None:
    """Coefficients to the last bit; the covariance to rounding, as it is stored as correlations."""
    assert found.coefficients.tolist() == expected.coefficients.tolist()
    assert found.standard_uncertainties.tolist() == pytest.approx(expected.standard_uncertainties.tolist(), rel=1e-15)
    np.testing.assert_allclose(found.covariance_array, expected.covariance_array, rtol=1e-14)


def test_every_triad_is_carried_over_and_counts_as_before(upgraded: tuple[Stores, dict[str, str]]) -> None:
    stores, _ = upgraded
    history = {(c.result_id, c.triad): c for c in stores.calibrations.list("U-1").items}
    assert len(history) == 5
    for name, values in (("a", BOTH), ("b", AGAIN), ("c", TURNS)):
        for value in values:
            assert_value(history[f"result-{name}", value.triad].value, value)
        assert history[f"result-{name}", "gyro"].id == f"calibration-{name}", "a remembered id still names one"
    assert {(c.result_id, c.triad) for c in stores.calibrations.current("U-1")} == {
        ("result-c", "gyro"),
        ("result-a", "accelerometer"),
    }, "the accelerometers get back what whole turns took, and not from a second analysis"
    assert all(c.by_rule and c.verdict is Verdict.PASS for c in stores.calibrations.current("U-1"))
    assert stores.units.unit("U-1").calibration_id("gyro") == "calibration-c"


def test_documents_trends_and_lineage_say_what_they_said(upgraded: tuple[Stores, dict[str, str]]) -> None:
    stores, jobs = upgraded
    for name, values in (("a", BOTH), ("b", AGAIN), ("c", TURNS)):
        found, expected = stores.results.get(f"result-{name}").document, old_document(values)
        for one, other in zip(found["triads"], expected["triads"], strict=True):
            assert one["coefficients"] == other["coefficients"]
            assert list(one["calibration"]) == list(other["calibration"])
            assert one["calibration"]["bias"] == list(other["calibration"]["bias"])
        assert found["more"] == expected["more"]
    trend = stores.results.values("U-1", "static_run", "gyro.b_x", simulated=True, limit=9)
    assert [v.quantity.value for v in trend if v.quantity] == [TURNS[0].bias[0], BOTH[0].bias[0]]
    used = stores.results.get("result-d").calibrations
    assert [c.triad for c in stores.calibrations.several(used)] == ["gyro", "accelerometer"]
    assert used[0] == "calibration-a"
    context = context_of(stores.jobs.get(jobs["verification"]), stores.calibrations.several)
    assert context.unit.calibration_ids == used
    for found, expected in zip(context.unit.calibrations, BOTH, strict=True):
        assert_value(found, expected)
    assert context_of(stores.jobs.get(jobs["calibration"]), stores.calibrations.several).unit.calibrations == ()


def test_no_coefficient_is_left_in_another_place(upgraded: tuple[Stores, dict[str, str]], database: Database) -> None:
    with database.engine.connect() as connection:
        tables = sa.inspect(connection).get_table_names()
        assert not [t for t in tables if t.endswith("_0007")]
        everything = json.dumps(
            [[str(cell) for cell in row] for t in tables for row in connection.execute(sa.text(f"SELECT * FROM {t}"))]
        )
    for value in (*BOTH, *AGAIN, *TURNS):
        assert [everything.count(repr(number)) for number in value.coefficients.tolist()] == [1] * 12


def test_the_way_back_and_forth_again_keeps_it(
    upgraded: tuple[Stores, dict[str, str]], database: Database, database_url: str
) -> None:
    stores, jobs = upgraded
    before = {(c.result_id, c.triad): c for c in stores.calibrations.list("U-1").items}
    migrated(database, "0007")
    with database.engine.connect() as connection:
        rows = connection.execute(sa.text("SELECT id, triads FROM calibrations ORDER BY id")).all()
        document = connection.scalar(sa.text("SELECT document FROM results WHERE id = 'result-a'"))
        context = connection.scalar(sa.text("SELECT context FROM jobs WHERE id = :id"), {"id": jobs["verification"]})
    read = [json.loads(x) if isinstance(x, str) else x for x in (rows[0][1], document, context)]
    assert [row[0] for row in rows] == ["calibration-a", "calibration-b", "calibration-c"]
    for found in (read[0], [one["calibration"] for one in read[1]["triads"]], read[2]["unit"]["calibrations"]):
        for one, value in zip(found, BOTH, strict=True):
            assert one["bias"] == list(value.bias)
            np.testing.assert_allclose(one["covariance"], value.covariance_array, rtol=1e-14)
    assert read[2]["unit"]["calibration_id"] == "calibration-a"
    assert read[1]["triads"][0]["coefficients"] == old_document(BOTH)["triads"][0]["coefficients"]
    open_stores(database_url)[1].dispose()
    after = {(c.result_id, c.triad): c for c in stores.calibrations.list("U-1").items}
    assert after.keys() == before.keys()
    for key, calibration in after.items():
        assert_value(calibration.value, before[key].value)


def test_contexts_of_earlier_versions_say_what_was_withheld(new_job: Callable[..., Job]) -> None:
    """They called the kind of a withheld correction its triad."""
    context = simulated_context()
    unit = replace(context.unit, withheld=(Withheld("gyro", "c1", "it expired"), Withheld("thermal", "c2", "rejected")))
    today = context_document(replace(context, unit=unit))
    early = {**today, "unit": {**today["unit"], "withheld": [old_form(w) for w in today["unit"]["withheld"]]}}
    for document in (today, early):
        job = new_job(context=document)
        assert context_of(job, lambda _: ()).unit.withheld == unit.withheld
        assert withheld_calibration(job, ["gyro", "accelerometer"]) == "it expired"
        assert context_of(job, lambda _: ()).unit.why_withheld("thermal") == "rejected"


def old_form(entry: dict[str, str]) -> dict[str, str]:
    return {"triad": entry["subject"], "id": entry["id"], "why": entry["why"]}
