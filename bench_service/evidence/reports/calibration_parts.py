"""Calibrations in a printed report: as found and as left, expanded uncertainties, unrounded values, trends."""

from collections.abc import Iterator, Sequence

from bench_service.evidence.reports.people_parts import moment, named
from bench_service.evidence.stores import EvidenceStores
from bench_service.formats.printed.digits import to_uncertainty, two_digits
from bench_service.formats.printed.document import Block, Facts, Heading, PrintedTable
from bench_service.model.calibrations import Approval, StoredCalibration
from bench_service.model.records import StoredResult
from procedures.core.imu_model import COEFFICIENT_NAMES
from procedures.core.limits import Verdict
from procedures.core.report import Figure, Series
from procedures.core.units import DISPLAY

FACTOR = 2.0
"""Coverage factor of expanded uncertainties: 95.45 % of a normal distribution."""
EXPANDED = "U is the expanded uncertainty, k = 2 (95.45 % of a normal distribution); values have its second digit."
FIGURES = 30
"""Newest calibrations that a trend shows."""


def found_before(stores: EvidenceStores, result: StoredResult) -> dict[str, StoredCalibration]:
    """Return, by triad, the calibration that was in use when a result's job began."""
    unit = result.context.get("unit") or {}
    return {c.triad: c for c in stores.calibrations.several(unit.get("calibration_ids") or ())}


def found_by(
    stores: EvidenceStores, one: StoredCalibration, history: Sequence[StoredCalibration]
) -> StoredCalibration | None:
    """Return the calibration that was in use when another one of its triad was measured; None: there was none.

    An entered one has no measurement: then it is the newest earlier one that neither failed nor was rejected.
    `history`: calibrations of the triad, newest first.
    """
    if one.result_id is not None:
        return found_before(stores, stores.results.get(one.result_id)).get(one.triad)
    fit = (c for c in history if c.approval is not Approval.REJECTED and c.verdict in (None, Verdict.PASS))
    return next((c for c in fit if c.made_at < one.made_at and c.id != one.id), None)


def found_and_left(stores: EvidenceStores, one: StoredCalibration, found: StoredCalibration | None) -> Iterator[Block]:
    """Coefficients of a calibration as left next to those as found, and their trend up to it.

    `found`: the triad's earlier calibration; None, or this one itself: there is none to compare it with.
    """
    yield Heading(f"Calibration of the {one.triad} triad, as found and as left")
    yield from coefficients(one, None if found is not None and found.id == one.id else found)
    history = stores.calibrations.list(one.unit, triad=one.triad, limit=200).items
    same = [c for c in history if c.made_at <= one.made_at and c.simulated == one.simulated]
    yield from trends(same, one.triad)


def coefficients(
    one: StoredCalibration,
    found: StoredCalibration | None,
    covariance: str = "The whole covariance is in the attached document.",
) -> Iterator[Block]:
    """Yield blocks on a calibration as left: values to their uncertainty with those as found, then all values
    unrounded. `covariance`: sentence on where the whole covariance is.
    """
    yield Facts(tuple(facts(one)))
    before = {} if found is None else {c.name: c for c in found.coefficients}
    rows: list[tuple[str, ...]] = []
    for c in one.coefficients:
        unit, size = DISPLAY.get(c.unit, (c.unit, 1.0))
        value, expanded = c.value / size, FACTOR * c.standard_uncertainty / size
        old = before.get(c.name)
        same = old is not None and old.unit == c.unit
        rows.append(
            (
                c.name,
                unit,
                to_uncertainty(value, expanded),
                two_digits(expanded),
                to_uncertainty(old.value / size, expanded) if old is not None and same else "–",
                to_uncertainty((c.value - old.value) / size, expanded) if old is not None and same else "–",
            )
        )
    columns = ("coefficient", "unit", "as left", "U (k = 2)", "as found", "change")
    yield PrintedTable(f"{one.triad} triad, U = b + K·v", columns, tuple(rows), (2, 3, 4, 5), EXPANDED)
    exact = tuple((c.name, c.unit, repr(c.value), repr(c.standard_uncertainty)) for c in one.coefficients)
    yield PrintedTable(
        f"{one.triad} triad, as stored in SI, to the last digit",
        ("coefficient", "unit", "value", "standard uncertainty"),
        exact,
        (2, 3),
        covariance,
    )


def facts(one: StoredCalibration) -> Iterator[tuple[str, str]]:
    """Yield rows (name, text) on a calibration's origin, use, approval and validity."""
    yield "calibration", one.id
    yield "method", one.method
    yield "origin", one.origin or (f"result {one.result_id}" if one.result_id else "not known")
    yield "in use", ("yes, by rule" if one.by_rule else "yes, chosen") if one.current else "no"
    yield "approval", one.approval.value
    ends = moment(one.valid_until) if one.valid_until else "no end is set"
    yield "valid until", ends
    for decision in one.decisions:
        who = named(decision.by, decision.proven) or "the rule"
        remark = f": {decision.remark}" if decision.remark else ""
        yield decision.act.value, f"{moment(decision.at)}, by {who}{remark}"


def trends(history: Sequence[StoredCalibration], triad: str) -> Iterator[Figure]:
    """Yield figures of biases and diagonal of K of a triad over its calibrations, oldest first, with expanded
    uncertainties.
    """
    shown = [c for c in reversed(history) if c.triad == triad and c.value.output_unit != "count"][-FIGURES:]
    if len(shown) < 2:
        return
    x = tuple(float(k) for k in range(1, len(shown) + 1))
    first, last = (c.made_at.date().isoformat() for c in (shown[0], shown[-1]))
    for title, names, about in (
        ("Bias", ("b_x", "b_y", "b_z"), 0.0),
        ("Scale factor less one", ("K11", "K22", "K33"), 1.0),
    ):
        places = [COEFFICIENT_NAMES.index(name) for name in names]
        unit, size = ("ppm", 1e-6) if about else DISPLAY.get(shown[0].coefficients[0].unit, ("", 1.0))
        series = tuple(
            Series(
                name,
                x,
                tuple((c.coefficients[i].value - about) / size for c in shown),
                tuple(FACTOR * c.coefficients[i].standard_uncertainty / size for c in shown),
                "line_points",
            )
            for name, i in zip(names, places, strict=True)
        )
        note = f"{len(shown)} calibrations from {first} to {last}; bars are expanded uncertainties, k = 2."
        yield Figure(
            f"{title} of the {triad} triad", "calibration, oldest first", f"{title}, {unit}", series, note=note
        )
