"""Tables and figures of calibrations and verifications: the thesis's figures 5.6-5.12 and Tables 5.1-5.4, reworded."""

from collections.abc import Sequence

from procedures.analysis.calibration.budget import Budget
from procedures.analysis.calibration.reference_temperature import ThermalShare
from procedures.analysis.calibration.summary import Coefficient, TriadSummary
from procedures.analysis.calibration.verification import Magnitudes
from procedures.core import units
from procedures.core.imu_model import COEFFICIENT_NAMES
from procedures.core.report import Figure, Series, Table

WEIGHTS = {"noise_and_table": "the noise and the table's declared accuracy", "noise": "the noise alone"}
SYMBOL = {"gyro": "|ω|", "accelerometer": "|g|"}


def triad_table(summary: TriadSummary) -> Table:
    """Return the table of a triad's coefficients from stations at rest."""
    note = f"U = b + K·v. Condition of the design {summary.condition:.3g}. Weighted by {WEIGHTS[summary.weighting]}."
    return coefficient_table(f"Coefficients of the {summary.calibration.triad} triad", summary.coefficients, note)


def coefficient_table(title: str, coefficients: Sequence[Coefficient], note: str) -> Table:
    """Return the table of estimates ± standard uncertainty in the units people read; scale factors as departures from
    one [ppm].
    """
    sources = tuple(coefficients[0].from_table_source)
    columns = ("coefficient", "unit", "estimate", "± standard uncertainty", "of noise", "of table", *sources)
    return Table(title, columns, tuple(_coefficient_row(c, sources) for c in coefficients), note)


def _coefficient_row(c: Coefficient, sources: Sequence[str]) -> tuple[str | float, ...]:
    name = c.name.symbol
    zero = 1.0 if name in ("K11", "K22", "K33") and c.unit == "1" else 0.0
    unit, size = ("ppm", units.PPM) if c.unit == "1" else units.DISPLAY.get(c.unit, (c.unit, 1.0))
    parts = (c.standard_uncertainty, c.from_noise, c.from_table, *(c.from_table_source[s] for s in sources))
    return (f"{name} − 1" if zero else name, unit, (c.estimate - zero) / size, *(part / size for part in parts))


def budget_table(triad: str, budgets: Sequence[Budget]) -> Table:
    """Return the uncertainty budget of each coefficient, source by source, with the expanded uncertainty below the
    rows.
    """
    rows: list[tuple[str | float, ...]] = []
    for budget in budgets:
        unit, size = ("ppm", units.PPM) if budget.unit == "1" else units.DISPLAY.get(budget.unit, (budget.unit, 1.0))
        name = budget.coefficient.symbol
        for r in budget.rows:
            freedom = "∞" if r.degrees_of_freedom is None else r.degrees_of_freedom
            of_source = (r.source, r.value, r.unit, r.distribution, r.divisor)
            rows.append((name, *of_source, r.sensitivity / size, r.contribution / size, unit, freedom))
        freedom = "∞" if budget.degrees_of_freedom is None else budget.degrees_of_freedom
        of_all = ("root sum of squares", "", "", "", "", "")
        rows.append((name, *of_all, budget.standard_uncertainty / size, unit, freedom))
        expanded = (f"expanded, k = {budget.coverage_factor:.3g}", "", "", "", "", "")
        rows.append((name, *expanded, budget.expanded_uncertainty / size, unit, ""))
    source = ("coefficient", "source", "value", "unit", "distribution", "divisor")
    columns = (*source, "sensitivity", "contribution", "in", "degrees of freedom")
    note = "Sensitivity: change of the coefficient by one unit of the source, all of its independent parts together."
    return Table(f"Uncertainty budget of the {triad} triad", columns, tuple(rows), note)


def budget_tables(triad: str, budgets: Sequence[Budget]) -> tuple[Table, ...]:
    """Return the table of `budget_table`; nothing for a result without budgets."""
    return (budget_table(triad, budgets),) if budgets else ()


def triad_figures(t: TriadSummary) -> tuple[Figure, ...]:
    """Return the figures of a triad: its magnitudes, then its residuals."""
    return (*magnitude_figures(t.magnitudes), residual_figure(t))


def residual_figure(summary: TriadSummary) -> Figure:
    """Return the figure of the residuals of the three channels at each station; error bars: the expected standard
    deviation of each residual.
    """
    c = summary.calibration
    unit, size = units.DISPLAY[c.output_unit]
    series = tuple(
        Series(
            axis,
            _stations(summary.magnitudes),
            tuple(r.residual[i] / size for r in summary.residuals),
            tuple(r.expected_sd[i] / size for r in summary.residuals),
        )
        for i, axis in enumerate("xyz")
    )
    p = (
        "not judged: the noise was estimated from these data"
        if summary.p_value is None
        else f"p = {summary.p_value:.3g}"
    )
    note = f"χ² = {summary.chi_square:.4g} with {summary.degrees_of_freedom} degrees of freedom, {p}."
    return Figure(f"Residuals of the {c.triad} triad", "orientation", f"output − model, {unit}", series, note=note)


def magnitude_figures(m: Magnitudes) -> tuple[Figure, ...]:
    """Return the figures of |v̂| before and after with the reference (5.6, 5.10), after alone (5.7, 5.11), errors (5.8,
    5.12).
    """
    unit, size = units.DISPLAY[m.unit]
    x, symbol = _stations(m), SYMBOL[m.triad]
    reference = Series("reference", x, (m.reference / size,) * len(x), style="reference")
    after = Series("after correction", x, tuple(v / size for v in m.after), style="line_points")
    mean = Series("mean", x, ((m.reference + m.mean_error_after) / size,) * len(x), style="line")
    both = (after, reference)
    if m.before is not None:
        both = (Series("before correction", x, tuple(v / size for v in m.before), style="line_points"), *both)
    errors = Series("after correction", x, tuple(e / size for e in m.errors), tuple(s / size for s in m.expected_sd))
    title = f"{symbol} of the {m.triad} triad"
    return (
        Figure(f"{title}, before and after correction", "orientation", f"{symbol}, {unit}", both),
        Figure(f"{title} after correction", "orientation", f"{symbol}, {unit}", (after, mean, reference)),
        Figure(
            f"Error of {title} after correction",
            "orientation",
            f"{symbol} − reference, {unit}",
            (errors, Series("zero", x, (0.0,) * len(x), style="reference")),
            note="Error bars: one expected standard deviation." if m.expected_sd else "",
        ),
    )


def sample_table(triads: Sequence[TriadSummary]) -> Table:
    """Return the table of magnitudes in sample, as the thesis's Tables 5.3 and 5.4 print them, with those out of
    sample.
    """
    named = [(m, f"{m.triad}, {kind}") for t in triads for kind, m in _samples(t)]
    note = (
        "In sample: corrected with the coefficients that these very stations gave, as in thesis tables 5.3 and 5.4; "
        "least squares makes the mean error small by itself. Out of sample: each station corrected by the others' fit."
    )
    table = magnitude_table([m for m, _ in named], "Magnitudes over the orientations, in sample and out of sample")
    rows = tuple((name, *row[1:]) for (_, name), row in zip(named, table.rows, strict=True))
    return Table(table.title, table.columns, rows, note)


def _samples(t: TriadSummary) -> tuple[tuple[str, Magnitudes], ...]:
    inside = ("in sample", t.magnitudes)
    return (inside,) if t.left_out is None else (inside, ("out of sample", t.left_out))


def magnitude_table(all_magnitudes: Sequence[Magnitudes], title: str) -> Table:
    """Return the table of mean error and standard deviation before and after (as in Tables 5.3, 5.4) and δ/√3 (thesis
    5.1).
    """
    rows: list[tuple[str | float | None, ...]] = []
    for m in all_magnitudes:
        unit, size = units.DISPLAY[m.unit]
        before = None if m.sd_before is None else m.sd_before / size
        rows.append(
            (
                m.triad,
                unit,
                m.mean_error_after / size,
                before,
                m.sd_after / size,
                m.per_axis / size,
                m.per_axis_sd / size,
            )
        )
    columns = ("triad", "unit", "mean error", "sd before", "sd after", "per axis δ/√3", "± standard uncertainty")
    return Table(title, columns, tuple(rows))


def station_table(m: Magnitudes) -> Table:
    """Return the table of the magnitude at every orientation, before and after correction, with its error and expected
    spread.
    """
    unit, size = units.DISPLAY[m.unit]
    before = m.before or (None,) * len(m.after)
    expected = m.expected_sd or (None,) * len(m.after)
    rows = tuple(
        (label, None if b is None else b / size, a / size, e / size, None if s is None else s / size)
        for label, b, a, e, s in zip(m.labels, before, m.after, m.errors, expected, strict=True)
    )
    columns = ("orientation", "before", "after", "error after", "expected sd")
    return Table(f"{SYMBOL[m.triad]} per orientation, {unit}", columns, rows)


def scalar_table(summary: TriadSummary) -> Table | None:
    """Return the table of the nine parameters from magnitudes alone against those of the linear fit; None without
    them.
    """
    if summary.scalar is None:
        return None
    rows = tuple(
        (p.name, p.unit, p.scalar, p.standard_uncertainty, p.linear, p.difference_sigmas)
        for p in summary.scalar.parameters
    )
    columns = ("parameter", "unit", "scalar", "± standard uncertainty", "linear", "difference, σ")
    note = f"From the magnitude alone; no angle of the table enters. Condition {summary.scalar.condition:.3g}."
    return Table(f"Scalar cross-check of the {summary.calibration.triad} triad", columns, rows, note)


def thermal_tables(share: ThermalShare, labels: Sequence[str]) -> list[Table]:
    """Return the tables of the thermal correction of the accelerometers' station means, and of its remaining
    uncertainty.
    """
    rows = zip(labels, share.case_c, share.converter_c, share.change_m_s2, strict=True)
    regime = f", regime taken as {share.regime}" if share.regime else ""
    parts = tuple((name, share.from_correction[name], share.from_sensors[name]) for name in COEFFICIENT_NAMES)
    return [
        Table(
            "Accelerometer outputs brought to the reference temperatures",
            ("orientation", "case, °C", "converter, °C", "added x, m/s^2", "added y, m/s^2", "added z, m/s^2"),
            tuple((label, case, board, *change) for label, case, board, change in rows),
            f"V₀ = Ṽ/K0 − B0, Ṽ by thesis 4.1 in the form {share.form.value}{regime}.",
        ),
        Table(
            "What the thermal correction leaves uncertain",
            ("coefficient", "from its coefficients", "from the temperature sensors"),
            parts,
            "Standard uncertainties, b in m/s²; they are a part of those of noise above.",
        ),
    ]


def _stations(m: Magnitudes) -> tuple[float, ...]:
    return tuple(float(i) for i in range(1, len(m.after) + 1))
