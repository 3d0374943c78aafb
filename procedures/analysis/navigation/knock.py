"""Detection of a unit's motion during alignment: a step of its attitude, by accelerometers and gyros.

A step of the attitude turns the horizontal specific force, ``δf = −δθ × f``, for good, and puts its whole angle into
the gyros at once. Accelerometers show tilt alone; gyros show heading too, where their noise is low enough. Both are
judged against the scatter of the rest of the recording, so that slow noise and warming up are no knock:

* accelerometers: differences of the means over `SPAN` cells after and before each cell, less their median, over their
  median deviation; white noise of the cells gives the least that deviation may be.
* gyros: single cells less the median, over the median deviation, times the cell's length: an angle.
"""

from dataclasses import dataclass

import numpy as np

from procedures.analysis.cells import cell_means
from procedures.core import units
from procedures.core.arrays import Array
from procedures.core.imu_model import TriadCalibration, correct
from procedures.core.recording import TRIADS, Recording

CELLS = 200
"""Number of cells of a recording, if it has as many samples."""
CELLS_MIN = 60
SPAN = 10
"""Cells on each side of a step from which its size is measured."""
LIKELY = 7.0
"""Deviations beyond which a step counts: among some 1,000 tested, once in 10⁹ by chance in normal noise, and rare
enough where slow noise makes deviations uneven."""
ROUNDING_RAD = 1e-12
"""Least scatter of angles [rad]: samples without any noise still differ by rounding."""
NORMAL = 1.4826
"""Standard deviation over median absolute deviation of a normal number."""


@dataclass(frozen=True)
class AttitudeStep:
    """The greatest step of the attitude in a recording: size, time, whether it is detected, and by which sensors."""

    seen: bool
    """True if the step exceeds the noise."""
    size_rad: float
    time_s: float
    """Time since the recording's beginning."""
    shown_by: str
    """"accelerometers" or "gyros"."""
    visible_rad: float
    """Least step of tilt that would have exceeded the noise."""


def attitude_step(recording: Recording, calibrations: dict[str, TriadCalibration]) -> AttitudeStep | None:
    """Return the greatest step of the attitude, detected or not; None for a recording of too few samples."""
    info = recording.info
    per_cell = max(1, info.count // CELLS)
    if info.count // per_cell < CELLS_MIN:
        return None
    names = TRIADS["accelerometer"] + TRIADS["gyro"]
    cells = cell_means(recording, names, per_cell / info.rate_hz)
    force = correct(cells.rates[:3].T, calibrations["accelerometer"])
    rate = correct(cells.rates[3:].T, calibrations["gyro"])
    of_tilt, of_turn = _tilt_steps(force), _turns(rate, cells.cell_s)
    candidates = [(*of_tilt[:3], "accelerometers", SPAN), (*of_turn, "gyros", 0)]
    ratio, size, index, by, before = max(candidates, key=lambda c: c[0])
    return AttitudeStep(ratio > LIKELY, size, (index + before) * cells.cell_s, by, of_tilt[3])


def _tilt_steps(force: Array) -> tuple[float, float, int, float]:
    """Tilt steps in forces (n, 3): greatest ratio to the scatter, its size [rad], place, least visible step [rad]."""
    mean = force.mean(axis=0)
    across = np.linalg.svd(mean[None, :])[2][1:]
    angles = force @ across.T / np.linalg.norm(mean)
    sums = np.cumsum(np.vstack([np.zeros(2), angles - angles.mean(axis=0)]), axis=0)
    means = (sums[SPAN:] - sums[:-SPAN]) / SPAN
    steps = means[SPAN:] - means[:-SPAN]
    steps = steps - np.median(steps, axis=0)
    white = _deviation(np.diff(angles, axis=0)) / np.sqrt(SPAN)
    scale = np.maximum(_deviation(steps), white)
    scale = np.maximum(scale, ROUNDING_RAD)
    ratios = np.max(np.abs(steps) / scale, axis=1)
    at = int(np.argmax(ratios))
    return float(ratios[at]), float(np.linalg.norm(steps[at])), at, float(LIKELY * np.max(scale))


def _turns(rate: Array, cell_s: float) -> tuple[float, float, int]:
    """Turns in rates (n, 3): greatest ratio to the scatter, that cell's excess angle [rad], its place."""
    off = rate - np.median(rate, axis=0)
    scale = _deviation(off)
    ratios = np.max(np.abs(off) / np.where(scale > 0.0, scale, np.inf), axis=1)
    at = int(np.argmax(ratios))
    return float(ratios[at]), float(np.linalg.norm(off[at])) * cell_s, at


def _deviation(values: Array) -> Array:
    """Standard deviation by the median, column by column: a few steps do not change it."""
    return np.asarray(NORMAL * np.median(np.abs(values - np.median(values, axis=0)), axis=0), dtype=np.float64)


def step_degrees(step: AttitudeStep | None) -> float:
    """Return the size of a detected step [deg], zero where there is none."""
    return step.size_rad / units.DEG if step is not None and step.seen else 0.0
