"""Thermal cycles of many units: errors of the coefficients, what was claimed of them, 3σ after, gyros' correlations."""

from collections.abc import Iterator
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass

import numpy as np
from scipy.stats import t as student

from procedures.analysis.thermal.correlation import Correlation, correlation
from procedures.analysis.thermal.fit import AxisFit, fit_correction
from procedures.analysis.thermal.judgement import magnitude, nearest, soaks, three_sigma
from procedures.analysis.thermal.runs import ThermalRun
from procedures.core import units
from procedures.core.noise import NoiseCoefficients
from procedures.core.thermal_correction import Form, ThermalCorrection
from simulators.chamber.behaviour import gyros
from simulators.truth import Array, keyed_generator
from simulators.truth.thermal import GyroThermalTruth, UnitThermalTruth, random_thermal_truth
from tests.validation.thermal_rig import (
    FAST,
    OTHER,
    THESIS_LIKE,
    Cycle,
    G,
    Leg,
    as_run,
    converter_bench,
    cycle,
    flicker,
    reference_c,
    stage_one,
    true_coefficients,
)

COVERAGE = 0.95
SELF_HEATING_C = 3.5
"""Of the case over the air."""
AFTER = {-20.0: (0.00012, 0.00015, 0.00013), 60.0: (0.00046, 0.00038, 0.00042)}
"""Table 4.5 "after" [m/s²]."""
BEFORE = {-20.0: (0.0975, 0.0968, 0.0715), 60.0: (0.1241, 0.1830, 0.1212)}
GYRO_RANDOM_WALK = 0.001425 * units.DEG_PER_SQRT_HOUR
GYRO_FLICKER = 0.0016 * units.DEG_PER_HOUR
"""Thesis table 4.1, gyro x."""
FAULT = 3e-4 * units.DEG_PER_HOUR
"""Residue of a failing perimeter control a °C: 0.03 °/h over 100 °C, where the limit of thesis 5.6 is 0.015."""
GYRO_LEVEL = 0.01


def runs_of(truth: UnitThermalTruth, legs: list[Leg], seed: int) -> tuple[list[ThermalRun], list[Cycle]]:
    """Three runs, x, y and z up, after stage one."""
    models = converter_bench(truth, seed)
    cycles = [cycle(truth, legs, up, 10 * seed + up) for up in range(3)]
    return [as_run(c, stage_one(c, truth, models), truth) for c in cycles], cycles


def estimates(correction: ThermalCorrection) -> Array:
    """α1 … α4, β1 … β4 of each axis, (3, 8)."""
    return np.array([[*a.alpha, *a.beta] for a in correction.axes])


def claimed(correction: ThermalCorrection) -> Array:
    """Their standard uncertainties, (3, 8)."""
    return np.array([a.standard_uncertainties() for a in correction.axes])


@dataclass(frozen=True)
class Outcome:
    """One unit."""

    normalised: Array
    """Errors over claimed standard uncertainties, (3, 8)."""
    inside: Array
    """Whether the 95 % interval holds the truth, 0 or 1, (3, 8)."""
    preferred: tuple[int, ...]
    """Order that the criterion prefers, of each axis."""


def judged(truth: UnitThermalTruth, fits: tuple[AxisFit, ...], correction: ThermalCorrection) -> Outcome:
    """The fit against the truth."""
    z = (estimates(correction) - true_coefficients(truth)) / claimed(correction)
    wide = np.array([student.isf((1.0 - COVERAGE) / 2, f.degrees_of_freedom) for f in fits])
    return Outcome(z, (np.abs(z) <= wide[:, None]).astype(np.float64), tuple(f.order.preferred for f in fits))


def one_unit(seed: int) -> Outcome:
    """A drawn unit through the default cycle."""
    truth = random_thermal_truth(seed)
    runs, _ = runs_of(truth, THESIS_LIKE, 1000 + seed)
    correction, fits = fit_correction(runs, reference_c(truth))
    return judged(truth, fits, correction)


def population(count: int, workers: int = 1) -> Iterator[Outcome]:
    """So many drawn units."""
    if workers == 1:
        yield from map(one_unit, range(count))
        return
    with ProcessPoolExecutor(workers) as pool:
        yield from pool.map(one_unit, range(count))


@dataclass(frozen=True)
class Worth:
    """Worth of a correction on a cycle that it was not fitted to."""

    before: dict[float, Array]
    """Soak -> root mean square over the three runs of 3σ before, (3,) [m/s²]."""
    after: dict[float, Array]
    """Soak -> the same after."""
    magnitude_static_m_s2: float
    magnitude_dynamic_m_s2: float
    """Of |ĝ| over the three runs, root mean square."""


def worth(correction: ThermalCorrection, runs: list[ThermalRun], at_c: tuple[float, ...] = (-20.0, 60.0)) -> Worth:
    """3σ at the soaks and |ĝ| of runs that this correction did not see."""
    before: dict[float, Array] = {}
    after: dict[float, Array] = {}
    for temperature in at_c:
        figures = []
        for run in runs:
            found = soaks(run)
            zero = nearest(found, 20.0 + SELF_HEATING_C)
            figures.append(three_sigma(run, correction, zero, nearest(found, temperature + SELF_HEATING_C)))
        before[temperature] = np.sqrt(np.mean([f.before**2 for f in figures], axis=0))
        after[temperature] = np.sqrt(np.mean([f.after**2 for f in figures], axis=0))
    g = [magnitude(run, correction, G) for run in runs]
    still, moving = (
        float(np.sqrt(np.mean(np.square(values))))
        for values in ([m.rms_static_m_s2 for m in g], [m.rms_dynamic_m_s2 for m in g])
    )
    return Worth(before, after, still, moving)


def forms_compared(truth: UnitThermalTruth, seed: int = 5) -> dict[Form, tuple[Worth, Worth]]:
    """Form -> its worth on another cycle (with soaks) and on the fast one (without), fitted on the default cycle."""
    fitted, other, fast = (runs_of(truth, legs, seed + i)[0] for i, legs in enumerate((THESIS_LIKE, OTHER, FAST)))
    found = {}
    for form in Form:
        correction, _ = fit_correction(fitted, reference_c(truth), form)
        found[form] = worth(correction, other), worth(correction, fast, ())
    return found


def gyro_correlations(
    run: Cycle, count: int, residue_rad_s_c: float, seed: int, known: bool = True
) -> list[Correlation]:
    """Gyro x of so many launches, minute by minute, against the case sensor of one cycle; its noise known or not."""
    declared = NoiseCoefficients(random_walk=GYRO_RANDOM_WALK, bias_instability=GYRO_FLICKER) if known else None
    truth = GyroThermalTruth((residue_rad_s_c,) * 3)
    felt, case = (
        v[: len(v) // 60 * 60].reshape(-1, 60).mean(axis=1) for v in (gyros(truth, run.nodes_c)[:, 0], run.codes[:, 0])
    )
    found = []
    for launch in range(count):
        rng = keyed_generator(seed, "gyro correlation", launch)
        noise = GYRO_FLICKER * flicker(rng, 60 * len(felt))[:, 0].reshape(-1, 60).mean(axis=1)
        noise += GYRO_RANDOM_WALK / np.sqrt(60.0) * rng.standard_normal(len(felt))
        found.append(correlation(noise + felt, case, 60.0, declared))
    return found
