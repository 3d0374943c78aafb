"""Tables and the figure of repeated alignments."""

from collections.abc import Sequence

from procedures.analysis.navigation.alignment import ThesisPrediction
from procedures.analysis.repeated_alignment.expected import ANGLES, CALIBRATION, LAUNCH, NOISE, TABLE
from procedures.analysis.repeated_alignment.observed import Alignment, AngleErrors
from procedures.core.report import Figure, Series, Table


def errors_table(angles: Sequence[AngleErrors]) -> Table:
    """Return the table of found and predicted errors, a row an angle [deg]."""
    columns = ("angle", "mean error", "± expected", "spread", "expected", "one alignment, expected", "χ²", "p")
    rows = tuple(
        (
            *(a.angle, a.mean_error_deg, a.mean_error_expected_sd_deg, a.spread_deg, a.expected_spread_deg),
            *(a.expected_sd_deg, a.chi_square, a.p_value),
        )
        for a in angles
    )
    return Table("Errors found and predicted [deg]", columns, rows, "χ² of all errors by their full covariance.")


def sources_table(angles: Sequence[AngleErrors]) -> Table:
    """Return the table of contributions to the expected standard uncertainty of one alignment [deg]."""
    sources = (CALIBRATION, LAUNCH, NOISE, TABLE)
    rows = tuple((a.angle, *(a.expected_by_source_deg[s] for s in sources)) for a in angles)
    return Table("Expected of one alignment, by source [deg]", ("angle", *sources), rows)


def alignments_table(alignments: Sequence[Alignment]) -> Table:
    """Return the table of alignments, one a row [deg]."""
    rows = tuple(
        (a.label, a.launch, *a.attitude_deg, *a.error_deg, *a.expected_sd_deg, a.duration_s) for a in alignments
    )
    angles = [f"{name}, deg" for name in ANGLES]
    heads = ("", "launch", *angles, *(f"error of {a}" for a in angles), *(f"± of {a}" for a in angles), "time, s")
    return Table("Alignments", heads, rows, "Errors against the table's angles and its declared azimuth.")


def heading_figure(alignments: Sequence[Alignment]) -> Figure:
    """Return the figure of the heading's error, alignment by alignment [deg]."""
    numbers = tuple(float(i) for i in range(1, len(alignments) + 1))
    errors = tuple(a.error_deg[0] for a in alignments)
    series = Series("heading", numbers, errors, tuple(a.expected_sd_deg[0] for a in alignments))
    note = "Error bars: one expected standard deviation of a single alignment."
    return Figure("Error of the heading", "alignment", "found − table, deg", (series,), note=note)


def sentence(heading: AngleErrors, thesis: ThesisPrediction | None) -> str:
    """Return the sentence on the expected error of the heading, and on the prediction of thesis 1.1. `thesis` None: the
    unit's noise is not known.
    """
    text = f"One alignment's heading is expected with a standard uncertainty of {heading.expected_sd_deg:.3g} deg"
    if thesis is None:
        return text + "."
    return (
        f"{text}; the azimuth error of thesis 1.1, of the noise within a launch alone, is {thesis.added_deg:.3g} deg "
        f"({thesis.independent_deg:.3g} deg where its parts are independent)."
    )
