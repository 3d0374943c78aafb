"""One quantity of many results: the queries, and the value in a row. No transaction begins here."""

from collections.abc import Iterator
from typing import Any, TypeVar

from sqlalchemy import Row, Select, and_, func, select
from sqlalchemy.orm import Session

from bench_service.mapping import copied
from bench_service.model.errors import NotFound
from bench_service.model.quantities import Quantity, quantity
from bench_service.model.records import ResultValue
from bench_service.persistence.evidence.calibration_rows import calibrations_where, with_coefficients
from bench_service.persistence.tables.evidence import (
    CalibrationRow,
    CoefficientRow,
    ResultQuantityRow,
    ResultRow,
)
from bench_service.persistence.tables.jobs import JobRow
from procedures.core.imu_model import COEFFICIENT_NAMES

Q = TypeVar("Q", bound=Select[*tuple[Any, ...]])
AT_ONCE, DOCUMENTS = 250, 20
"""Number of rows read at once, and where the quantity is a JSON pointer, each with its document."""
ABOUT = (
    ResultRow.id,
    ResultRow.job_id,
    ResultRow.created_at,
    ResultRow.simulated,
    ResultRow.code_version,
    ResultRow.parameters,
)


def of_verdicts(query: Q, unit: str, procedure: str, simulated: bool) -> Q:
    """Limit a query to the results that gave jobs of the unit their verdict, newest first; no repeated analyses."""
    return (
        query.join(JobRow, and_(JobRow.id == ResultRow.job_id, JobRow.result_id == ResultRow.id))
        .where(ResultRow.unit == unit, ResultRow.name == procedure, ResultRow.simulated == simulated)
        .order_by(ResultRow.id.desc())
    )


def values_query(name: str) -> Select[*tuple[Any, ...]]:
    """Select the columns that `value_of_row` needs; the whole document only where a JSON pointer leads into it."""
    if name.startswith("/"):
        return select(*ABOUT, ResultRow.document)
    kept = ResultQuantityRow
    named = and_(kept.result_id == ResultRow.id, kept.name == name)
    triad, _, symbol = name.partition(".")
    if symbol not in COEFFICIENT_NAMES:
        return select(*ABOUT, kept.value, kept.unit, kept.standard_uncertainty).outerjoin(kept, named)
    given, number = CalibrationRow, CoefficientRow
    return (
        select(
            *ABOUT,
            func.coalesce(kept.value, number.value).label("value"),
            func.coalesce(kept.unit, number.unit).label("unit"),
            func.coalesce(kept.standard_uncertainty, number.standard_uncertainty).label("standard_uncertainty"),
        )
        .outerjoin(kept, named)
        .outerjoin(given, and_(given.result_id == ResultRow.id, given.triad == triad))
        .outerjoin(number, and_(number.calibration_id == given.id, number.name == symbol))
    )


def newest_first(
    session: Session, query: Select[*tuple[Any, ...]], before: str | None
) -> Iterator[Row[*tuple[Any, ...]]]:
    """All rows of a query that begins with the newest id, or with the newest one older than `before`."""
    query = query.limit(DOCUMENTS if ResultRow.document.key in query.selected_columns else AT_ONCE)
    while rows := session.execute(query if before is None else query.where(ResultRow.id < before)).all():
        yield from rows
        before = rows[-1].id


def value_of_row(session: Session, row: Row[*tuple[Any, ...]], name: str) -> ResultValue:
    """Read the value of the quantity from one result's row."""
    about = {"result": row.id, "job": row.job_id, "at": row.created_at}
    return copied(ResultValue, row, **about, quantity=_quantity(session, row, name))


def _quantity(session: Session, row: Row[*tuple[Any, ...]], name: str) -> Quantity | None:
    if not name.startswith("/"):
        return None if row.value is None else Quantity(name, row.value, row.unit, row.standard_uncertainty)
    given = calibrations_where(session, CalibrationRow.result_id == row.id)
    try:
        return quantity(with_coefficients(row.document, given), name)
    except NotFound:
        return None
