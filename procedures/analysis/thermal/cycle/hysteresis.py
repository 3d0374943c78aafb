"""Difference of a corrected accelerometer at one temperature reached from below and from above, with its uncertainty.

The two soaks lie hours apart, and the sensor's noise is slow: the variance of the difference of their means is that of
a contrast, ``Σ_k C_k²·s_k`` with C its cosines and s those of the channel's noise: the unit's, where it is known from
launches at rest; else the fit's own, which takes a part of a hysteresis for a slow noise.
"""

from collections.abc import Sequence
from math import erfc, sqrt

import numpy as np

from procedures.analysis.coloured_noise import cosines, unit_variances
from procedures.analysis.thermal.cycle.forms import RunSoaks
from procedures.analysis.thermal.cycle.results import Hysteresis
from procedures.analysis.thermal.cycle.runs import PreparedRun
from procedures.analysis.thermal.judgement import Corrects, Soak, corrected
from procedures.core.arrays import Array
from procedures.core.noise import NoiseCoefficients
from procedures.core.recording import AXES


def hysteresis(
    runs: Sequence[PreparedRun], soaked: Sequence[RunSoaks], judged: Corrects, noises: Sequence[NoiseCoefficients]
) -> tuple[Hysteresis, ...]:
    """Return the hysteresis of every axis at every target that a run reached both ways: the level reached from below
    less that from above; `noises` are those of x, y, z.

    A run's first leg has no way. Several legs up, or down, are taken together.
    """
    found: list[Hysteresis] = []
    for run, soaks in zip(runs, soaked, strict=True):
        forces = corrected(run.cells, judged)
        targets = [leg.target_c for leg in run.series.legs]
        shapes = unit_variances(len(forces), run.cells.cell_s)
        for target in sorted(set(targets)):
            up, down = (_legs(targets, soaks, target, way) for way in (1.0, -1.0))
            if not up or not down:
                continue
            contrast = _weights(len(forces), up) - _weights(len(forces), down)
            turned = cosines(contrast) ** 2
            for axis, name in enumerate(AXES):
                n = noises[axis]
                squares = np.square([n.quantization, n.random_walk, n.bias_instability, n.rate_random_walk])
                sd = float(judged.scales[axis]) * sqrt(float(turned @ (squares @ shapes)))
                gap = float(contrast @ forces[:, axis])
                p_value = erfc(abs(gap) / sd / sqrt(2.0)) if sd > 0.0 else 0.0
                found.append(Hysteresis(run.series.name, name, target, gap, sd, p_value))
    return tuple(found)


def _legs(targets: Sequence[float], soaks: RunSoaks, target: float, way: float) -> list[Soak]:
    return [
        soaks.of_leg[k]
        for k in range(1, len(targets))
        if targets[k] == target and np.sign(targets[k] - targets[k - 1]) == way and k in soaks.of_leg
    ]


def _weights(count: int, soaks: Sequence[Soak]) -> Array:
    """Weights (n,) of the mean over some soaks, each counting alike."""
    weights = np.zeros(count)
    for soak in soaks:
        weights[soak.start : soak.stop] += 1.0 / (soak.stop - soak.start) / len(soaks)
    return weights
