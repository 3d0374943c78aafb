"""Tables and figures of whole turns."""

from procedures.analysis.turns.summary import RatePoint, WholeTurns
from procedures.core import units
from procedures.core.recording import AXES
from procedures.core.report import Figure, Series, Table
from procedures.reports.calibration import coefficient_table


def turns_table(found: WholeTurns) -> Table:
    """Return the table of the gyro triad's coefficients, the terms beyond the linear ones included."""
    note = (
        f"U = b + a + s/2·|a| + q·a²/a₀ + c·a³/a₀², a = K·ω, a₀ = {found.reference_rate_deg_s:g} deg/s. "
        f"Condition of the design {found.condition:.3g}."
    )
    return coefficient_table("Coefficients of the gyro triad from whole turns", found.coefficients, note)


def rate_table(found: WholeTurns) -> Table:
    """Return the table of every station's scale factor against the model."""
    ppm = units.PPM
    rows = tuple(
        (p.axis, p.rate_deg_s, p.turns, p.departure / ppm, p.standard_uncertainty / ppm, p.modelled / ppm)
        for p in found.points
    )
    columns = ("axis", "rate, deg/s", "turns", "departure, ppm", "± standard uncertainty, ppm", "model, ppm")
    return Table("Scale factor at each rate, departure from K", columns, rows)


def rate_figures(found: WholeTurns) -> tuple[Figure, ...]:
    """Return the figures of the departure of the scale factor over the rates, one an axis."""
    judged = (
        "not judged: the noise was estimated from these data" if found.p_value is None else f"p = {found.p_value:.3g}"
    )
    note = f"χ² = {found.chi_square:.4g} with {found.degrees_of_freedom} degrees of freedom over all axes, {judged}."
    return tuple(_figure(axis, [p for p in found.points if p.axis == axis], note) for axis in AXES)


def _figure(axis: str, points: list[RatePoint], note: str) -> Figure:
    in_order = sorted(points, key=lambda p: p.rate_deg_s)
    x, ppm = tuple(p.rate_deg_s for p in in_order), units.PPM
    series = (
        Series(
            "measured",
            x,
            tuple(p.departure / ppm for p in in_order),
            tuple(p.standard_uncertainty / ppm for p in in_order),
        ),
        Series("model", x, tuple(p.modelled / ppm for p in in_order), style="line"),
        Series("K", x, (0.0,) * len(x), style="reference"),
    )
    return Figure(f"Scale factor of gyro {axis} over the rates", "rate, deg/s", "departure, ppm", series, note=note)
