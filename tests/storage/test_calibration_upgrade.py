"""The upgrade from the tables before calibrations had a triad each: what is stored is carried over, numbers and all."""

import json
from typing import Any

import sqlalchemy as sa

from tests.storage.conftest import NOW
from tests.storage.test_calibrations import document_of

MOMENT = sa.DateTime(timezone=True)
"""A unit with three old rows: both triads by a job that passed (a), the same again as a second analysis (b), and the
gyros alone by a whole-turns job (c), which was current: it had removed the accelerometers' calibration."""


def _json(value: Any) -> str:
    from pydantic_core import to_jsonable_python

    return json.dumps(to_jsonable_python(value))


def insert(connection: sa.Connection, table: str, **values: Any) -> None:
    columns = ", ".join(f'"{name}"' for name in values)
    names = ", ".join(f":{name}" for name in values)
    moments = [sa.bindparam(name, type_=MOMENT) for name in values if name.endswith("_at")]
    connection.execute(sa.text(f"INSERT INTO {table} ({columns}) VALUES ({names})").bindparams(*moments), values)


def add_old(connection: sa.Connection, name: str, values: list[Any], *, current: bool, gave_verdict: bool) -> None:
    """A job's result with its calibration as the code before the upgrade wrote them."""
    documents = [document_of(v)["triads"][0] for v in values]
    for document in documents:
        document["coefficients"] = document["coefficients"] if document["calibration"]["triad"] == "gyro" else []
    context = {"unit": {"serial": "U-1", "calibration_id": None, "calibrations": []}, "bench": {}}
    insert(
        connection,
        "results",
        id=f"result-{name}",
        kind="procedure",
        name="calibration_12_orientations" if len(values) == 2 else "scale_factor_whole_turns",
        version="1",
        parameters="{}",
        document=_json({"triads": documents, "checks": [], "more": [{"name": "plain", "unit": "1", "estimate": 0.5}]}),
        verdict="pass",
        code_version="abc",
        simulated=True,
        created_at=NOW,
        unit="U-1",
        job_id=None,
        seed=3,
        context=_json(context),
    )
    for row in (row for document in documents for row in document["coefficients"]):
        insert(
            connection,
            "result_quantities",
            result_id=f"result-{name}",
            name=row["name"],
            value=row["estimate"],
            unit=row["unit"],
            standard_uncertainty=row["standard_uncertainty"],
        )
    insert(
        connection,
        "result_quantities",
        result_id=f"result-{name}",
        name="plain",
        value=0.5,
        unit="1",
        standard_uncertainty=None,
    )
    insert(
        connection,
        "calibrations",
        id=f"calibration-{name}",
        unit="U-1",
        result_id=f"result-{name}",
        made_at=NOW,
        is_current=current,
        triads=_json(values),
        simulated=True,
    )
