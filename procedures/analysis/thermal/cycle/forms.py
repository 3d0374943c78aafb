"""Performance of each correction form on a cycle, beside the polynomial of paper C (thesis table 4.5, 3.2.3).

A correction is judged by what it leaves: 3σ at each soak about the run's own reference soak, and |ĝ| over the run.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from procedures.analysis.thermal.cycle.results import FormFound, SoakFound
from procedures.analysis.thermal.cycle.runs import PreparedRun
from procedures.analysis.thermal.judgement import Corrects, Soak, ThreeSigma, magnitude, nearest, soaks, three_sigma
from procedures.analysis.thermal.normalised import fit_normalised
from procedures.analysis.thermal.profile_progress import LegEvidence
from procedures.analysis.thermal.runs import AXES
from procedures.core.arrays import Array
from procedures.core.converter import Normalised
from procedures.core.errors import UnfitRecording


@dataclass(frozen=True)
class RunSoaks:
    """Stretches of the static regime of one run, by leg of its profile."""

    reference: Soak
    """The one nearest to the correction's reference."""
    of_leg: dict[int, Soak]
    """The longest of each leg that has one."""


def soaks_of(run: PreparedRun, reference_c: float) -> RunSoaks:
    """Return the soaks of a run and its reference soak. Raises `UnfitRecording` where it has no soak at all."""
    found = soaks(run.cells)
    if not found:
        raise UnfitRecording(
            f"{run.series.name}: the unit's temperature was never static: there is no soak to judge by"
        )
    of_leg: dict[int, Soak] = {}
    for soak in found:
        middle_s = 0.5 * (soak.start + soak.stop) * run.cells.cell_s
        leg = _leg_at(run.series.legs, middle_s)
        if leg not in of_leg or soak.stop - soak.start > of_leg[leg].stop - of_leg[leg].start:
            of_leg[leg] = soak
    return RunSoaks(nearest(tuple(of_leg.values()), reference_c, within_c=np.inf), of_leg)


def _leg_at(legs: Sequence[LegEvidence], t_s: float) -> int:
    return next((i for i, leg in enumerate(legs) if t_s < leg.ended_s), len(legs) - 1)


def soak_table(runs: Sequence[PreparedRun], found: Sequence[RunSoaks], correction: Corrects) -> tuple[SoakFound, ...]:
    """Return 3σ at the soaks of every leg, root mean square over the runs."""
    legs = sorted({leg for soaked in found for leg in soaked.of_leg})
    answers: list[SoakFound] = []
    for leg in legs:
        figures = [
            three_sigma(run.cells, correction, soaked.reference, soaked.of_leg[leg])
            for run, soaked in zip(runs, found, strict=True)
            if leg in soaked.of_leg
        ]
        answers.append(
            SoakFound(
                leg,
                runs[0].series.legs[leg].target_c,
                float(np.mean([f.soak.case_c for f in figures])),
                len(figures),
                *(_over_runs(figures, name) for name in ("before", "after", "spread_before", "spread_after")),
            )
        )
    return tuple(answers)


def _over_runs(figures: Sequence[ThreeSigma], name: str) -> tuple[float, float, float]:
    x, y, z = np.sqrt(np.mean([getattr(f, name) ** 2 for f in figures], axis=0)).tolist()
    return x, y, z


def performance_of(
    name: str, runs: Sequence[PreparedRun], found: Sequence[RunSoaks], correction: Corrects, gravity_m_s2: float
) -> FormFound:
    """Return the errors that a correction leaves over all runs: worst 3σ at a soak by axis, and rms of |ĝ| − g."""
    x, y, z = np.max([s.after_m_s2 for s in soak_table(runs, found, correction)], axis=0).tolist()
    g = [magnitude(run.cells, correction, gravity_m_s2) for run in runs]
    still, moving = (
        float(np.sqrt(np.nanmean(np.square(values))))
        for values in ([m.rms_static_m_s2 for m in g], [m.rms_dynamic_m_s2 for m in g])
    )
    return FormFound(name, (x, y, z), still, moving)


@dataclass(frozen=True)
class NormalisedTriad:
    """Triad model of paper C: zero and scale of each axis as normalised polynomials of the case temperature."""

    zeros: tuple[Normalised, Normalised, Normalised]
    """Output at zero force, V0 + Fs(t) [m/s²]."""
    gains: tuple[Normalised, Normalised, Normalised]
    """Scale K·Fc(t), output per force."""

    @property
    def scales(self) -> Array:
        return np.array([1.0 / gain.at_reference for gain in self.gains])

    def apply(self, output_m_s2: Array, case_c: Array, converter_c: Array, dynamic: ArrayLike) -> Array:
        """Return ``f = (V − V0 − Fs(t))/(K·Fc(t))`` at case temperatures (n,), or (n, 3) by axis; other arguments are
        not used.
        """
        own = case_c if case_c.ndim == 2 else np.repeat(case_c[:, None], 3, axis=1)
        columns = [
            (output_m_s2[:, axis] - zero.value(own[:, axis])) / gain.value(own[:, axis])
            for axis, (zero, gain) in enumerate(zip(self.zeros, self.gains, strict=True))
        ]
        return np.column_stack(columns)


def normalised_triad(
    runs: Sequence[PreparedRun], found: Sequence[RunSoaks], reference_c: float, order: int = 2
) -> NormalisedTriad:
    """Zeros from the soaks of the runs in which an axis is horizontal, scales from those in which it is up.

    Raises `UnfitRecording` where there are too few soaks, `Undetermined`.
    """
    zeros: list[Normalised] = []
    gains: list[Normalised] = []
    for axis in range(len(AXES)):
        means = [_soak_means(run, soaked, axis) for run, soaked in zip(runs, found, strict=True)]
        c_up, v_up, f_up = _joined([m for m, run in zip(means, runs, strict=True) if run.cells.up == axis])
        c_level, v_level, f_level = _joined([m for m, run in zip(means, runs, strict=True) if run.cells.up != axis])
        gain = float(np.mean((v_up - np.mean(v_level)) / f_up))
        zero = fit_normalised(c_level, v_level - gain * f_level, reference_c, order, relative=False)
        zeros.append(zero)
        gains.append(fit_normalised(c_up, (v_up - zero.value(c_up)) / f_up, reference_c, order, relative=True))
    return NormalisedTriad((zeros[0], zeros[1], zeros[2]), (gains[0], gains[1], gains[2]))


def _soak_means(run: PreparedRun, soaked: RunSoaks, axis: int) -> Array:
    """Mean case temperature, output of an axis and force along it in each soak of a run, (3, n)."""
    each, force = soaked.of_leg.values(), run.cells.force_m_s2[axis]
    rows = [(s.case_c, float(np.mean(run.cells.output_m_s2[s.start : s.stop, axis])), force) for s in each]
    return np.array(rows, dtype=np.float64).reshape(-1, 3).T


def _joined(means: Sequence[Array]) -> Array:
    return np.concatenate(means, axis=1)
