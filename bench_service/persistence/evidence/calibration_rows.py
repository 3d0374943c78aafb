"""Conversion of calibrations to rows and back, and a result's document without their numbers and with them again.

A coefficient is stored once: where a document has a calibration of its result, or an estimate that is one of its
coefficients, the stored document has null, and the numbers come back from the rows. No transaction begins here.
"""

from collections import defaultdict
from collections.abc import Iterable, Mapping, Sequence
from typing import Any

import numpy as np
from pydantic import TypeAdapter
from sqlalchemy import ColumnElement, select
from sqlalchemy.orm import InstrumentedAttribute, Session

from bench_service.mapping import copied
from bench_service.model.calibrations import (
    Act,
    Approval,
    Coefficient,
    Decision,
    StoredCalibration,
    coefficients_of,
)
from bench_service.persistence.tables.evidence import (
    CalibrationDecisionRow,
    CalibrationRow,
    CoefficientRow,
    ResultRow,
)
from procedures.core.imu_model import COEFFICIENT_NAMES, TriadCalibration, triad_calibration
from procedures.core.limits import Verdict

TRIAD = TypeAdapter(TriadCalibration)
_NUMBERS = ("output_unit", "input_unit", "bias", "matrix", "covariance", "model")
"""Fields of a calibration in a stored document that are null there."""
_ESTIMATE = ("estimate", "unit", "standard_uncertainty")
"""Fields of an estimate in a stored document that are null where it is a coefficient of the result's calibration."""
_PAIRS = np.tril_indices(len(COEFFICIENT_NAMES), -1)
"""Pairs of coefficients in the order of the stored correlations."""


def rows_of(calibration: StoredCalibration) -> tuple[CalibrationRow, list[CoefficientRow]]:
    """Convert a calibration to its row and those of its coefficients; its decisions are added one by one."""
    correlations = calibration.value.correlations[_PAIRS].tolist()
    row = copied(
        CalibrationRow,
        calibration,
        calibration.value,
        correlations=correlations,
        is_current=calibration.current,
        approval=calibration.approval.value,
    )
    coefficients = [
        copied(CoefficientRow, c, calibration_id=calibration.id, position=position)
        for position, c in enumerate(calibration.coefficients)
    ]
    return row, coefficients


def decision_row(decision: Decision) -> CalibrationDecisionRow:
    """Convert a decision to its row."""
    return copied(CalibrationDecisionRow, decision, act=decision.act.value)


def calibrations_where(
    session: Session, *conditions: ColumnElement[bool] | InstrumentedAttribute[bool]
) -> list[StoredCalibration]:
    """Return the calibrations that meet all conditions, in the order of their ids."""
    query = select(CalibrationRow).where(*conditions).order_by(CalibrationRow.id)
    return complete(session, session.scalars(query).all())


def complete(session: Session, rows: Sequence[CalibrationRow]) -> list[StoredCalibration]:
    """Convert rows to calibrations in their order, with three more queries however many they are."""
    if not rows:
        return []
    ids = [row.id for row in rows]
    coefficients: dict[str, list[CoefficientRow]] = defaultdict(list)
    numbers = select(CoefficientRow).where(CoefficientRow.calibration_id.in_(ids)).order_by(CoefficientRow.position)
    for number in session.scalars(numbers):
        coefficients[number.calibration_id].append(number)
    decisions: dict[str, list[Decision]] = defaultdict(list)
    made = select(CalibrationDecisionRow).where(CalibrationDecisionRow.calibration_id.in_(ids))
    for decided in session.scalars(made.order_by(CalibrationDecisionRow.id)):
        decisions[decided.calibration_id].append(copied(Decision, decided, act=Act(decided.act)))
    results = {row.result_id for row in rows if row.result_id is not None}
    verdicts: dict[str, Verdict] = {}
    if results:
        for result_id, verdict in session.execute(
            select(ResultRow.id, ResultRow.verdict).where(ResultRow.id.in_(results))
        ):
            verdicts[result_id] = Verdict(verdict)
    return [
        copied(
            StoredCalibration,
            row,
            value=_value(row, coefficients[row.id]),
            verdict=None if row.result_id is None else verdicts[row.result_id],
            current=row.is_current,
            approval=Approval(row.approval),
            decisions=tuple(decisions[row.id]),
        )
        for row in rows
    ]


def _value(row: CalibrationRow, coefficients: Sequence[CoefficientRow]) -> TriadCalibration:
    sd = np.array([c.standard_uncertainty for c in coefficients])
    correlations = np.eye(len(sd))
    correlations[_PAIRS] = row.correlations
    covariance = (correlations + np.tril(correlations, -1).T) * np.outer(sd, sd)
    values = [c.value for c in coefficients]
    return triad_calibration(row.triad, row.output_unit, row.input_unit, values, covariance, row.model)


def without_coefficients(
    document: Mapping[str, Any], calibrations: Sequence[TriadCalibration]
) -> tuple[dict[str, Any], frozenset[str]]:
    """Return the document to store, with null for the numbers that the calibrations have; and the names of those
    estimates.
    """
    if not calibrations:
        return dict(document), frozenset()
    whole = [TRIAD.dump_python(c, mode="json") for c in calibrations]
    known = _estimates(calibrations)
    taken: set[str] = set()

    def stripped(node: Any) -> Any:
        if isinstance(node, list):
            return [stripped(child) for child in node] if _nested(node) else node
        if not isinstance(node, Mapping):
            return node
        if any(node == triad for triad in whole):
            return {key: None if key in _NUMBERS else value for key, value in node.items()}
        found = {key: stripped(value) for key, value in node.items()}
        name = node.get("name")
        if isinstance(name, str) and name in known and known[name] == tuple(node.get(key) for key in _ESTIMATE):
            taken.add(name)
            found |= dict.fromkeys(_ESTIMATE)
        return found

    return stripped(document), frozenset(taken)


def with_coefficients(document: dict[str, Any], calibrations: Sequence[StoredCalibration]) -> dict[str, Any]:
    """Return a stored document with the numbers of its result's calibrations in their places again."""
    if not calibrations:
        return document
    whole = {c.triad: TRIAD.dump_python(c.value, mode="json") for c in calibrations}
    known = _estimates([c.value for c in calibrations])

    def filled(node: Any) -> Any:
        if isinstance(node, list):
            return [filled(child) for child in node] if _nested(node) else node
        if not isinstance(node, Mapping):
            return node
        if node.get("triad") in whole and "covariance" in node and node["covariance"] is None:
            return {key: whole[node["triad"]][key] for key in node}
        found = {key: filled(value) for key, value in node.items()}
        name = node.get("name")
        if isinstance(name, str) and name in known and "estimate" in node and node["estimate"] is None:
            found |= dict(zip(_ESTIMATE, known[name], strict=True))
        return found

    return filled(document)


def _estimates(calibrations: Iterable[TriadCalibration]) -> dict[str, tuple[float, str, float]]:
    coefficients: list[Coefficient] = [c for value in calibrations for c in coefficients_of(value)]
    return {str(c.dotted): (c.value, c.unit, c.standard_uncertainty) for c in coefficients}


def _nested(node: Sequence[Any]) -> bool:
    """Lists of plain numbers are long, and are not searched."""
    return bool(node) and isinstance(node[0], Mapping | list)
