"""``python -m tests.validation.multi_position [--units N]``: the thesis's fourteen rests, units and tables drawn anew.

Errors over claimed standard uncertainties of the 24 coefficients, and of K2 and the sensitivity of gyros to specific
force where a unit has them, against χ² of N with the 36 tests sharing 1 % of false alarms; errors beyond four standard
uncertainties; and how often those further terms are claimed of units that do not have them.
"""

import argparse
import os
import sys

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")  # before numpy: one thread a worker

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from scipy.stats import binom, chi2, norm

from procedures.analysis.calibration.extra_terms import CLAIMED, TermEstimate
from procedures.analysis.calibration.reference import TRIAD_NAMES
from procedures.core import units
from procedures.core.arrays import Array
from procedures.core.recording import GYRO, MemoryRecording
from procedures.procedure import Context
from simulators.dwell_means import dwell_means
from simulators.truth import UnitTruth, declared_unit, keyed_generator, random_unit_truth
from simulators.world import WorldConfig, launch_truth
from tests.validation.judgement import NAMES
from tests.validation.population import SCENARIOS, discover, recordings

FIRST_SEED = 6_000_000
LEVEL = 0.01
PROCEDURE = discover()["multi_position_calibration"]
QUADRATIC_PPM, SENSITIVITY = 14.0, 0.05 * units.DEG_PER_HOUR / units.STANDARD_GRAVITY
"""Standard deviations of the terms that are drawn: about five standard uncertainties of this plan. The cross terms of
``(K·v)²``, which the model of K2 leaves out, are then below a tenth of the noise."""
FAR = 4.0
"""Standard uncertainties beyond which an error is counted."""


@dataclass(frozen=True)
class Found:
    """Results of one unit: z are errors over claimed standard uncertainties."""

    z: Array
    """z of the coefficients, (24,)."""
    absent: tuple[TermEstimate, ...]
    """Terms asked of a unit that has none."""
    present: dict[str, float]
    """z of each term that the unit has, by its name."""
    seen: int
    """Number of these that were reported present."""


def one_unit(seed: int) -> Found:
    """A unit without further terms, then the same one with them, at the same table."""
    scenario = SCENARIOS[2]
    truth, bench = random_unit_truth(seed), scenario.bench(seed)
    context = Context(declared_unit(truth), bench.description)
    params = PROCEDURE.resolve(PROCEDURE.params(), context)
    config, stations = WorldConfig(truth, bench, seed), PROCEDURE.schedule(params)
    taken = recordings(config, stations, 1)
    made = PROCEDURE.calibrations(PROCEDURE.analyse(taken, params, context))
    true = [launch_truth(config, 1)[name] for name in TRIAD_NAMES]
    errors = np.concatenate([c.coefficients for c in made]) - np.concatenate([np.column_stack(t).ravel() for t in true])
    more = params.model_copy(update={"terms": ("quadratic", "g_sensitivity")})
    absent = _terms(PROCEDURE.analyse(taken, more, context))
    bent, sensitivity = _with_terms(truth, seed)
    config = replace(config, unit=bent)
    felt = dwell_means(config, stations, 1).specific_force_b @ sensitivity.T
    whole = PROCEDURE.analyse(_sensitive(recordings(config, stations, 1), felt), more, context)
    known = _true_terms(bent, sensitivity, true[1][1])
    present = {t.name: (t.estimate - known[t.name]) / t.standard_uncertainty for t in _terms(whole)}
    z = errors / np.concatenate([c.standard_uncertainties for c in made])
    return Found(z, absent, present, sum(t.present for t in _terms(whole)))


def _terms(result: Any) -> tuple[TermEstimate, ...]:
    return tuple(t for e in result.extended for t in e.terms)


def _with_terms(truth: UnitTruth, seed: int) -> tuple[UnitTruth, Array]:
    """The unit with a square in its accelerometers, and the sensitivity (3, 3) of its gyros to force."""
    dice = keyed_generator(seed, "further terms")
    square = tuple((QUADRATIC_PPM * dice.standard_normal(3)).tolist())
    bent = replace(truth, accelerometer=replace(truth.accelerometer, scale_factor_nonlinearity_ppm=square))
    return bent, SENSITIVITY * dice.standard_normal((3, 3))


def _sensitive(taken: Sequence[MemoryRecording], felt: Array) -> list[MemoryRecording]:
    """Recordings with a rate (n, 3) added to their gyros, which come first."""
    added = np.concatenate([felt, np.zeros_like(felt)], axis=1)
    assert [c.name for c in taken[0].info.channels[:3]] == list(GYRO)
    return [replace(r, raw=r.raw + row) for r, row in zip(taken, added, strict=True)]


def _true_terms(truth: UnitTruth, sensitivity: Array, matrix: Array) -> dict[str, float]:
    """K2 of v², for which the truth has that of the output ``a = K·v``, and G, by their names."""
    accelerometer = truth.accelerometer
    square = units.PPM * np.array(accelerometer.scale_factor_nonlinearity_ppm) / accelerometer.nonlinearity_reference
    known = {f"K2_{axis}": float(q * k**2) for axis, q, k in zip("xyz", square, np.diagonal(matrix), strict=True)}
    return known | {f"G_{a}{b}": float(sensitivity[i, j]) for i, a in enumerate("xyz") for j, b in enumerate("xyz")}


def main() -> int:
    """Print every coefficient's spread; 1 where one lies outside."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--units", type=int, default=300)
    count = parser.parse_args().units
    found = [one_unit(FIRST_SEED + k) for k in range(count)]
    extra = list(found[0].present)
    z = np.array([[*f.z, *f.present.values()] for f in found])
    low, high = (chi2.ppf(p, count) / count for p in (LEVEL / 2 / z.shape[1], 1.0 - LEVEL / 2 / z.shape[1]))
    squares = np.mean(z**2, axis=0)
    for name, square, worst in zip([*NAMES, *extra], squares, np.abs(z).max(axis=0), strict=True):
        mark = "" if low < square < high else "  OUTSIDE"
        print(f"{name:24} sd of errors / claimed {np.sqrt(square):.3f}   largest {worst:.2f} sd{mark}")
    print(f"{count} units; allowed {np.sqrt(low):.3f} … {np.sqrt(high):.3f}")
    far, chance = int(np.sum(np.abs(z) > FAR)), float(2.0 * norm.sf(FAR))
    most_far = int(binom.ppf(1.0 - 1e-3, z.size, chance))
    print(f"beyond {FAR:g} sd: {far} of {z.size}, {z.size * chance:.2f} expected, at most {most_far} by chance")
    held = bool(np.all((low < squares) & (squares < high))) and far <= most_far
    for what, kind in (("K2", "quadratic"), ("g-sensitivity", "g_sensitivity")):
        asked = [t.present for f in found for t in f.absent if t.kind == kind]
        most = int(binom.ppf(1.0 - 1e-3, len(asked), CLAIMED))
        print(f"absent {what} claimed {sum(asked)} of {len(asked)} times, at most {most} by chance")
        held &= sum(asked) <= most
    print(
        f"of terms drawn with five standard uncertainties, {sum(f.seen for f in found)} of {len(extra) * count} claimed"
    )
    return 0 if held else 1


if __name__ == "__main__":
    sys.exit(main())
