"""Polarity of a unit's channels: which axis each one answers to, and with which sign.

Each axis of the unit in turn points upwards and is turned once, by 360°, about the vertical. Gyro channel c answers to
the turn of axis k with ``(∫U_c dt − Ū_c·T)/2π ≈ K_ck``: the mean Ū at rest at the end of the recording takes out bias
and the Earth's rate. Accelerometer channel c answers to the axis that points upwards with ``Ū_c/g = K_ck + b_c/g``. A
good unit gives nearly the identity: tenths are asked, so neither noise nor an uncalibrated scale factor counts.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from math import pi

import numpy as np

from procedures.analysis.own_axes import axes_answered, wrong_axes
from procedures.core.arrays import Array
from procedures.core.errors import UnfitRecording
from procedures.core.recording import AXES, TRIADS, Recording, rates


@dataclass(frozen=True)
class Answers:
    """Answers of a triad's channels to the three axes, and what they mean."""

    triad: str
    matrix: tuple[tuple[float, ...], ...]
    """Row: channel x, y, z; column: axis turned or pointed upwards. Per unit of the input; see `relative`."""
    relative: bool
    """True for channels in counts: the matrix is divided by its largest element."""
    axes: tuple[str, ...]
    """Axis that each channel answers to: "+x", "−y", "nothing" or "no single axis"."""

    @property
    def permutation(self) -> Array | None:
        """Signed permutation (3, 3), rows the channels and columns the unit's axes; None where a channel has no axis of
        its own, or shares one.
        """
        found = np.zeros((3, 3))
        for row, axis in enumerate(self.axes):
            if axis[1:] not in AXES:
                return None
            found[row, AXES.index(axis[1:])] = 1.0 if axis[0] == "+" else -1.0
        return found if abs(round(float(np.linalg.det(found)))) == 1 else None


def answers(recordings: Sequence[Recording], triad: str, turned_s: float, gravity_m_s2: float) -> Answers:
    """Answers to three recordings, axis x, y, z upwards, each turned once in its first `turned_s`, then at rest.

    Raises `UnfitRecording` where no rest is left or the channels' units differ, and `MissingChannel`.
    """
    names = TRIADS[triad]
    rows = np.array([_answer(r, names, triad, turned_s, gravity_m_s2) for r in recordings]).T
    units = {r.info.channels[r.info.column(n)].rate_unit for r in recordings for n in names}
    if len(units) != 1:
        raise UnfitRecording(f"the {triad} channels have different units: {', '.join(sorted(units))}")
    relative = units == {"count"}
    largest = float(np.abs(rows).max())
    matrix = rows / largest if relative and largest > 0.0 else rows
    return Answers(triad, tuple(tuple(row) for row in matrix.tolist()), relative, axes_answered(matrix))


def _answer(recording: Recording, names: Sequence[str], triad: str, turned_s: float, gravity_m_s2: float) -> Array:
    """Answer of three channels to one recording, (3,)."""
    info, samples = recording.info, rates(recording, names)
    rest = samples[round((turned_s + 0.5 * (info.duration_s - turned_s)) * info.rate_hz) :]
    if info.duration_s <= turned_s or not len(rest):
        raise UnfitRecording(f"recording {info.id}: {info.duration_s:g} s end before the rest after the turn begins")
    at_rest = rest.mean(axis=0)
    if triad == "accelerometer":
        return at_rest / gravity_m_s2
    return np.asarray((samples.mean(axis=0) - at_rest) * info.duration_s / (2.0 * pi), dtype=np.float64)


def sentences(both: Sequence[Answers]) -> tuple[str, ...]:
    """Return the faults of each triad, and whether a turned mounting would explain it, as sentences; empty for a good
    unit.
    """
    wrong = [a for a in both if a.axes != ("+x", "+y", "+z")]
    said = [wrong_axes(a.triad, a.axes) for a in wrong]
    made = [a.permutation for a in wrong]
    if len(made) == 2 and made[0] is not None and made[1] is not None and np.array_equal(made[0], made[1]):
        turned = round(float(np.linalg.det(made[0]))) == 1
        said.append(
            "both triads are wrong in the same way: the unit is mounted turned on its table, or the axes of its whole "
            "output are exchanged"
            if turned
            else "both triads are wrong in the same way, which no mounting can do: the unit's axes are left-handed"
        )
    return tuple(said)
