"""Table of a diagnosis: which coefficient moved since the calibration, and by how much."""

from collections.abc import Sequence

from procedures.analysis.calibration.diagnosis import Change, TriadDiagnosis
from procedures.core import units
from procedures.core.report import Cell, Table

COLUMNS = (
    "coefficient",
    "unit",
    "change",
    "± standard uncertainty",
    "sigma",
    "named with 90 % from",
    "p-value of the rest if it alone moved",
)


def diagnosis_tables(diagnoses: Sequence[TriadDiagnosis]) -> tuple[Table, ...]:
    """Return one table a triad of changed coefficients, the largest change first."""
    return tuple(_table(d) for d in diagnoses)


def _table(d: TriadDiagnosis) -> Table:
    movements = "".join(
        f" A {m.what} by {', '.join(f'{a:+.4g}' for a in m.arcsec)} arcsec leaves p = {m.p_value:.3g}."
        for m in d.movements
    )
    refitted = "" if d.p_value_refitted is None else f" After all are fitted p = {d.p_value_refitted:.3g}."
    note = (
        f"{d.sentence} Each is scored after all others are fitted; named from {d.threshold_sigmas:.2f} σ. "
        f"If nothing moved, residuals as large have p = {d.p_value_unchanged:.3g}.{refitted}{movements}"
    )
    return Table(f"Changes of the {d.triad} triad since its calibration", COLUMNS, tuple(map(_row, d.changes)), note)


def _row(c: Change) -> tuple[Cell, ...]:
    unit, size = ("ppm", units.PPM) if c.unit == "1" else units.DISPLAY.get(c.unit, (c.unit, 1.0))
    values = (c.change, c.standard_uncertainty)
    change, sd = (None if v is None else v / size for v in values)
    smallest = None if c.smallest_named is None else c.smallest_named / size
    return (c.name, unit, change, sd, c.sigmas, smallest, c.p_value_alone)
