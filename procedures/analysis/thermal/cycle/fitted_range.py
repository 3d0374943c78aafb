"""Temperature range of a correction's fit, and warnings where a cycle goes beyond it."""

from collections.abc import Sequence

import numpy as np

from procedures.analysis.thermal.runs import ThermalRun
from procedures.core.thermal_correction import EXTRAPOLATED_C, TemperatureRange, ThermalCorrection


def range_of(cells: Sequence[ThermalRun]) -> TemperatureRange:
    """Return the temperature range that the fit's cells cover."""
    case, board = (np.concatenate([getattr(c, name) for c in cells]) for name in ("case_c", "converter_c"))
    return TemperatureRange((float(case.min()), float(case.max())), (float(board.min()), float(board.max())))


def extrapolated(cells: Sequence[ThermalRun], judged: ThermalCorrection) -> list[str]:
    """Return a warning where the judged correction was not fitted at the cycle's temperatures."""
    if judged.fitted_range is None:
        return ["the judged correction does not say at which temperatures it was fitted: it may be extrapolated"]
    beyond = max(float(judged.fitted_range.beyond_c(c.case_c, c.converter_c).max()) for c in cells)
    if beyond <= EXTRAPOLATED_C:
        return []
    return [
        f"the cycle goes up to {beyond:.1f} K beyond the range in which the judged correction was fitted "
        f"({judged.fitted_range}): there it is extrapolated"
    ]
