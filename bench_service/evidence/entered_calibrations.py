"""Calibrations that a person enters: the twelve coefficients of a passport, a certificate or a table of a paper."""

from collections.abc import Sequence
from dataclasses import dataclass
from datetime import datetime, timedelta

import numpy as np

from bench_service.model.calibrations import ENTERED, Approval, StoredCalibration
from bench_service.wall_clock import new_id, now
from procedures.core.arrays import Array
from procedures.core.errors import BadParameter
from procedures.core.imu_model import COEFFICIENT_NAMES, TriadCalibration, coefficient_unit, triad_calibration
from procedures.core.units import converted

INPUT_UNITS = {"gyro": "rad/s", "accelerometer": "m/s^2"}
SINGULAR = 1e-12
"""Reciprocal condition of K below which the unit would not measure some direction."""
SLACK = timedelta(minutes=5)
"""Difference between clocks that is allowed where a moment must lie in the past."""


@dataclass(frozen=True)
class EnteredCoefficient:
    """One coefficient as a person typed it: name, value, unit, standard uncertainty."""

    name: str
    """Symbol as in `COEFFICIENT_NAMES`: "b_x", "K11", …"""
    value: float
    unit: str
    """Unit of the value: SI, or one that people read (deg/h, µg, ppm); "count" and "count/(rad/s)" for raw outputs."""
    standard_uncertainty: float
    """One standard uncertainty in the same unit; zero for a coefficient that is fixed by definition."""


@dataclass(frozen=True)
class Entry:
    """Known coefficients of a triad as a person entered them, with their origin and validity."""

    triad: str
    origin: str
    """Source of the numbers: a passport, a certificate, a table of a paper."""
    coefficients: tuple[EnteredCoefficient, ...]
    correlations: tuple[tuple[float, ...], ...] | None = None
    """Correlations (12, 12) in the order of `COEFFICIENT_NAMES`; None: the coefficients are not correlated."""
    measured_at: datetime | None = None
    """Time of the measurement that gave them; None: not known, now counts."""
    valid_from: datetime | None = None
    valid_until: datetime | None = None


def stored_calibration(unit: str, entry: Entry) -> StoredCalibration:
    """Return the entered calibration of a unit, converted to SI, ready to be stored. Raises `BadParameter` naming
    field, value and range.
    """
    if not entry.origin.strip():
        raise BadParameter("origin", entry.origin, "the source of the numbers: a passport, a certificate, a table")
    at = now()
    if entry.measured_at is not None and entry.measured_at > at + SLACK:
        raise BadParameter("measured_at", entry.measured_at.isoformat(), "a moment in the past")
    if entry.valid_from and entry.valid_until and entry.valid_until <= entry.valid_from:
        raise BadParameter("valid_until", entry.valid_until.isoformat(), "later than valid_from")
    return StoredCalibration(
        id=new_id(),
        unit=unit,
        value=_calibration(entry),
        method=ENTERED,
        origin=entry.origin.strip(),
        result_id=None,
        verdict=None,
        made_at=entry.measured_at or at,
        simulated=False,
        current=False,
        by_rule=False,
        approval=Approval.OPEN,
        valid_from=entry.valid_from,
        valid_until=entry.valid_until,
    )


def _calibration(entry: Entry) -> TriadCalibration:
    given = {c.name: (position, c) for position, c in enumerate(entry.coefficients)}
    missing = [name for name in COEFFICIENT_NAMES if name not in given]
    if missing or len(entry.coefficients) != len(COEFFICIENT_NAMES):
        wanted = f"each of {', '.join(COEFFICIENT_NAMES)} once"
        raise BadParameter("coefficients", f"without {', '.join(missing)}" if missing else "twice", wanted)
    input_unit = INPUT_UNITS[entry.triad]
    output_unit = "count" if given["b_x"][1].unit == "count" else input_unit
    values, sds = np.empty(12), np.empty(12)
    for row, name in enumerate(COEFFICIENT_NAMES):
        position, coefficient = given[name]
        unit = coefficient_unit(name, output_unit, input_unit)
        try:
            values[row] = converted(coefficient.value, coefficient.unit, unit)
            sds[row] = converted(coefficient.standard_uncertainty, coefficient.unit, unit)
        except ValueError as error:
            field = f"coefficients.{position}.unit"
            raise BadParameter(field, coefficient.unit, f"a unit that converts to {unit} ({name})") from error
    matrix = values.reshape(3, 4)[:, 1:]
    if 1.0 / np.linalg.cond(matrix) < SINGULAR:
        raise BadParameter("coefficients", matrix.tolist(), "a matrix K that can be inverted")
    covariance = _correlations(entry.correlations) * np.outer(sds, sds)
    return triad_calibration(entry.triad, output_unit, input_unit, values, covariance, ENTERED)


def _correlations(given: Sequence[Sequence[float]] | None) -> Array:
    """Correlations as a matrix. Raises `BadParameter` for what no twelve random numbers can have."""
    if given is None:
        return np.eye(12)
    if len(given) != 12 or any(len(row) != 12 for row in given):
        raise BadParameter("correlations", f"{len(given)} rows", "12 rows of 12")
    matrix = np.array(given, dtype=np.float64)
    if np.any(np.diagonal(matrix) != 1.0) or np.any(matrix != matrix.T):
        raise BadParameter("correlations", "not a correlation matrix", "symmetric, with 1 on the diagonal")
    least = float(np.linalg.eigvalsh(matrix)[0])
    if least < -1e-9:
        raise BadParameter("correlations", f"an eigenvalue of {least:.2g}", "a matrix without negative eigenvalues")
    return matrix
