"""Performance of a correction: 3σ at each soak before and after, and |ĝ| over the whole cycle (thesis table 4.5).

Thesis 4.5 leaves open the reference of its 3σ. It is taken as the whole departure from the same launch's output in its
reference soak, ``3·√(mean((v − v_ref)²))`` over the steady part of the soak: that is what an uncorrected unit is wrong
by, and it is of the printed size. The spread about the soak's own mean is reported as well.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import ArrayLike

from procedures.analysis.thermal.runs import ThermalRun
from procedures.core.arrays import Array
from procedures.core.errors import BadParameter, UnfitRecording


class Corrects(Protocol):
    """A map of outputs and temperatures to specific forces: `ThermalCorrection`, or an alternative to compare with.
    Interface.
    """

    @property
    def scales(self) -> Array:
        """Scale K0 of each axis, (3,)."""
        ...

    def apply(self, output_m_s2: Array, case_c: Array, converter_c: Array, dynamic: ArrayLike) -> Array:
        """Return specific forces (n, 3) [m/s²] of outputs (n, 3) at sensor temperatures [°C]."""
        ...


@dataclass(frozen=True)
class Soak:
    """A stretch of one run in the static regime: cells `start` … `stop` − 1."""

    start: int
    stop: int
    case_c: float
    """Mean of the case sensor."""


def soaks(run: ThermalRun, least_s: float = 900.0) -> tuple[Soak, ...]:
    """Return the stretches of the static regime that last at least `least_s` [s]. Raises `BadParameter`."""
    if not 0.0 < least_s < np.inf:
        raise BadParameter("least_s", least_s, "finite and above 0")
    edges = np.flatnonzero(np.diff(np.concatenate([[1], run.dynamic.astype(np.int8), [1]])))
    case = run.case_c if run.case_c.ndim == 1 else run.case_c.mean(axis=1)
    return tuple(
        Soak(int(a), int(b), float(np.mean(case[a:b])))
        for a, b in zip(edges[::2], edges[1::2], strict=True)
        if (b - a) * run.cell_s >= least_s
    )


def nearest(found: Sequence[Soak], case_c: float, within_c: float = 8.0) -> Soak:
    """The soak nearest to a case temperature: self-heating keeps the case some degrees above the air.

    Raises `UnfitRecording` where none lies within.
    """
    best = min(found, key=lambda s: abs(s.case_c - case_c), default=None)
    if best is None or abs(best.case_c - case_c) > within_c:
        raise UnfitRecording(f"no soak within {within_c:g} °C of {case_c:g} °C")
    return best


@dataclass(frozen=True)
class ThreeSigma:
    """Errors of one soak of one run, x, y, z, each (3,) [m/s²]."""

    soak: Soak
    before: Array
    """Departure from the reference soak, uncorrected outputs over K0."""
    after: Array
    """Departure of the corrected specific forces from the reference soak."""
    spread_before: Array
    """Spread about the soak's own mean."""
    spread_after: Array


def corrected(run: ThermalRun, correction: Corrects) -> Array:
    """Return the specific forces of a run's cells, (n, 3) [m/s²]."""
    return correction.apply(run.output_m_s2, run.case_c, run.converter_c, run.dynamic)


def three_sigma(run: ThermalRun, correction: Corrects, reference: Soak, at: Soak) -> ThreeSigma:
    """Return the errors 3σ before and after correction at a soak, relative to the run's own reference soak."""
    before = run.output_m_s2 * correction.scales
    after = corrected(run, correction)
    own, zero = slice(at.start, at.stop), slice(reference.start, reference.stop)
    departures = [3.0 * np.sqrt(np.mean((v[own] - v[zero].mean(axis=0)) ** 2, axis=0)) for v in (before, after)]
    spreads = [3.0 * np.std(v[own], axis=0, ddof=1) for v in (before, after)]
    return ThreeSigma(at, departures[0], departures[1], spreads[0], spreads[1])


@dataclass(frozen=True)
class Magnitude:
    """``|ĝ| = √(ĝ_x² + ĝ_y² + ĝ_z²)`` over a run, less gravity [m/s²] (thesis 3.2.3, the end)."""

    errors_m_s2: Array
    """Errors of the magnitude, shape (n,)."""
    rms_static_m_s2: float
    """Rms about the run's mean; NaN where there is no such cell."""
    rms_dynamic_m_s2: float


def magnitude(run: ThermalRun, correction: Corrects, gravity_m_s2: float) -> Magnitude:
    """Return |ĝ| − g over a run of the corrected triad."""
    errors = np.linalg.norm(corrected(run, correction), axis=1) - gravity_m_s2
    about = errors - np.mean(errors)
    still, moving = about[~run.dynamic], about[run.dynamic]
    return Magnitude(
        errors,
        float(np.sqrt(np.mean(still**2))) if len(still) else float("nan"),
        float(np.sqrt(np.mean(moving**2))) if len(moving) else float("nan"),
    )
