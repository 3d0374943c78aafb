"""Writes a position program in the language that `dialect` reads; also has the positions of the thesis's own
program.
"""

from collections.abc import Iterable, Sequence

import numpy as np

from procedures.analysis.table_program.dialect import AXES, DEMAND, MODE, Dwell
from procedures.core.table_angles import TableAngles

THESIS_POSITIONS = (
    *((0.0, 0.0, 0.0, 10.0), (-9.0, 90.0, 135.0, 102.0), (-189.0, 90.0, 135.0, 60.0), (-189.0, 90.0, -45.0, 60.0)),
    *((-189.0, -90.0, -45.0, 60.0), (-189.0, -90.0, -135.0, 60.0), (-9.0, -90.0, -135.0, 60.0)),
    *((-9.0, -90.0, 45.0, 60.0), (-9.0, 90.0, 45.0, 60.0), (-9.0, 0.0, 45.0, 60.0), (-189.0, 0.0, 45.0, 60.0)),
    *((-189.0, 180.0, 45.0, 60.0), (-189.0, 180.0, -45.0, 60.0), (-189.0, 0.0, -45.0, 60.0)),
    *((-189.0, -90.0, -45.0, 60.0), (0.0, 0.0, 0.0, 100.0)),
)
"""(outer, middle, inner) [deg] and delay [s] of the calibration program in the thesis's appendix Д."""


def write_program(dwells: Iterable[Dwell], axes: Sequence[str] = AXES) -> str:
    """The program that `read_program` reads as the same dwells with these `axes`, but for the numbers of the lines.

    Every demand names all three axes, so that a program can be cut in two anywhere. Numbers have as many digits as they
    need to be read back exactly.
    """
    named = f"% axis 1 {axes[0]}, 2 {axes[1]}, 3 {axes[2]} [deg]"
    lines = [f"{named}; a delay [s] counts from the demand before it", f"{MODE} all"]
    for dwell in dwells:
        a = dwell.angles
        of_axis = {"outer": a.outer_deg, "middle": a.middle_deg, "inner": a.inner_deg}
        one, two, three = (_number(of_axis[name]) for name in axes)
        lines += ["", f"{DEMAND} 1,{one}; p 2,{two}; p 3,{three}", f"delay {_number(dwell.delay_s)}"]
    return "\n".join(lines) + "\n"


def dwells_at(positions: Iterable[tuple[float, float, float, float]]) -> tuple[Dwell, ...]:
    """Return dwells from (outer, middle, inner) [deg] and delay [s]."""
    return tuple(Dwell(TableAngles(outer, middle, inner), delay) for outer, middle, inner, delay in positions)


def _number(value: float) -> str:
    return np.format_float_positional(value + 0.0, trim="-")
