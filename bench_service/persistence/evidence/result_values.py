"""One quantity of many results: the queries, and the value in a row. No transaction begins here."""

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

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

AT_ONCE, DOCUMENTS = 250, 20
"""Number of results that one statement reads; of results with their documents (the quantity is a JSON pointer)."""
ABOUT = (
    ResultRow.id,
    ResultRow.job_id,
    ResultRow.created_at,
    ResultRow.simulated,
    ResultRow.code_version,
    ResultRow.parameters,
)


@dataclass(frozen=True)
class VerdictResults:
    """Queries of the results that gave jobs of a unit their verdict; no repeated analyses."""

    unit: str
    procedure: str
    simulated: bool

    def newest_first(
        self, session: Session, query: Select[*tuple[Any, ...]], before: str | None = None, at_once: int = AT_ONCE
    ) -> Iterator[Row[*tuple[Any, ...]]]:
        """Yield the rows of a query of such results, from the newest id on, or from the newest one older than `before`.

        Ids come first, by an index alone: with the join in one statement Postgres expects a single row, and sorts all.
        """
        mine = (ResultRow.unit == self.unit, ResultRow.name == self.procedure, ResultRow.simulated == self.simulated)
        ids = select(ResultRow.id).order_by(ResultRow.id.desc()).limit(at_once)
        query = query.join(JobRow, and_(JobRow.id == ResultRow.job_id, JobRow.result_id == ResultRow.id))
        older = mine if before is None else (*mine, ResultRow.id < before)
        while known := session.scalars(ids.where(*older)).all():
            oldest = known[-1]
            yield from session.execute(query.where(*older, ResultRow.id >= oldest).order_by(ResultRow.id.desc()))
            older = (*mine, ResultRow.id < oldest)


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


def value_of_row(session: Session, row: Row[*tuple[Any, ...]], name: str) -> ResultValue:
    """Read the value of the quantity from a row of `values_query(name)`, of the same name."""
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
