"""Repeatability of a unit's seat: how much its cross-couplings differ between repeated mountings (thesis 5.1)."""

from math import sqrt

from pydantic import Field

from procedures.analysis.repeatability.seat_repeatability import CrossCoupling, seat_repeatability
from procedures.core import units
from procedures.core.errors import BadParameter
from procedures.core.imu_model import TriadCalibration
from procedures.core.limits import ASKED, Limit, check, verdict
from procedures.core.report import Figure, Report, Series, Table
from procedures.core.unit import Unit
from procedures.procedure import DatedCalibration, Evidence, JudgedParameters, Method, Outcome

TRIADS = ("gyro", "accelerometer")


class Params(JudgedParameters):
    """Requirement on the repeatability of the seat."""

    repeatability_arcsec: float = Field(
        20.0, gt=0.0, le=36_000.0, description="Largest standard deviation of a cross-coupling between mountings"
    )


class Result(Outcome):
    """Repeatability of each cross-coupling over the mountings."""

    mountings: tuple[str, ...]
    """Ids of the mountings, in the order of their first calibration."""
    cross_couplings: tuple[CrossCoupling, ...]


def analyse(evidence: Evidence, params: Params, unit: Unit | None) -> Result:
    """Return the scatter of cross-couplings between mountings, triad by triad. Raises `BadParameter` for fewer than two
    mountings.
    """
    bare = [c.id for c in evidence.calibrations if not c.mounting]
    if bare:
        raise BadParameter("calibrations", ", ".join(bare), "calibrations by jobs that rest on a mounting")
    mountings = tuple(dict.fromkeys(c.mounting for c in sorted(evidence.calibrations, key=_made)))
    found: list[CrossCoupling] = []
    for triad in TRIADS:
        groups = {name: _of(evidence, name, triad) for name in mountings}
        filled = {name: group for name, group in groups.items() if group}
        if len(filled) >= 2:
            found += seat_repeatability(filled)
    if not found:
        raise BadParameter(
            "calibrations", len(evidence.calibrations), "one triad under at least two mountings is needed"
        )
    limit = Limit("arcsec", maximum=params.repeatability_arcsec, source=ASKED)
    size = units.ARCSEC
    checks = tuple(
        check(f"{c.triad} {c.name} seat", c.sd / size, limit, c.sd / size / sqrt(2.0 * (len(c.values) - 1)))
        for c in found
    )
    warnings = tuple(
        f"{c.triad} {c.name}: the limit cannot be resolved, the calibrations' own uncertainty is "
        f"{c.expected_from_measurement / size:.3g} arcsec"
        for c in found
        if c.expected_from_measurement >= params.repeatability_arcsec * size
    )
    return Result(
        checks=checks, verdict=verdict(checks), warnings=warnings, mountings=mountings, cross_couplings=tuple(found)
    )


def _made(calibration: DatedCalibration) -> str:
    return calibration.made_at


def _of(evidence: Evidence, mounting: str, triad: str) -> list[TriadCalibration]:
    return [
        c for dated in evidence.calibrations if dated.mounting == mounting for c in dated.triads if c.triad == triad
    ]


def report(result: Result) -> Report:
    """Return the report: checks, scatter between and within mountings, and each cross-coupling over the mountings."""
    size = units.ARCSEC
    rows = tuple(
        (
            *(c.triad, c.name),
            *(value / size for value in (c.mean, c.sd, c.low, c.high)),
            None if c.within_sd is None else c.within_sd / size,
            *(value / size for value in (c.expected_from_measurement, c.seat_sd)),
        )
        for c in result.cross_couplings
    )
    heads = (
        "triad",
        "coefficient",
        "mean",
        "sd",
        "95 % from",
        "95 % to",
        "within a mounting",
        "of measurement",
        "seat",
    )
    note = f"Arcseconds, over {len(result.mountings)} mountings; seat: what measurement does not explain."
    return Report(
        sections=(Table("Repeatability of the seat", heads, rows, note), *map(_figure, result.cross_couplings))
    )


def _figure(c: CrossCoupling) -> Figure:
    x = tuple(float(i) for i in range(1, len(c.values) + 1))
    points = Series(c.name, x, tuple(v / units.ARCSEC for v in c.values), (), "line_points")
    mean = Series("mean", x, (c.mean / units.ARCSEC,) * len(x), style="reference")
    return Figure(f"{c.triad} {c.name}", "mounting", f"{c.name}, arcsec", (points, mean))


METHOD = Method("mounting_repeatability", "Repeatability of the seat", "1.0.0", Params, Result, analyse, report)
