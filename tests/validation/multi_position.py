"""``python -m tests.validation.multi_position [--units N]``: the thesis's fourteen rests, units and tables drawn anew.

Errors over claimed standard uncertainties of the 24 coefficients, against χ² of N with the 24 tests sharing 1 % of
false alarms; the largest error; and how often further terms that no unit has are claimed.
"""

import argparse
import os
import sys

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")  # before numpy: one thread a worker

import numpy as np
from scipy.stats import binom, chi2

from procedures.analysis.calibration.extra_terms import CLAIMED
from procedures.analysis.calibration.reference import TRIAD_NAMES
from procedures.core.arrays import Array
from procedures.procedure import Context
from simulators.truth import declared_unit, random_unit_truth
from simulators.world import WorldConfig, launch_truth
from tests.validation.judgement import NAMES
from tests.validation.population import SCENARIOS, discover, recordings

FIRST_SEED = 6_000_000
LEVEL = 0.01
PROCEDURE = discover()["multi_position_calibration"]


def one_unit(seed: int) -> tuple[Array, int]:
    """Errors over claimed uncertainties (24,), and how many of three absent terms were claimed."""
    scenario = SCENARIOS[2]
    truth, bench = random_unit_truth(seed), scenario.bench(seed)
    context = Context(declared_unit(truth), bench.description)
    params = PROCEDURE.resolve(PROCEDURE.params(), context)
    taken = recordings(WorldConfig(truth, bench, seed), PROCEDURE.schedule(params), 1)
    made = PROCEDURE.calibrations(PROCEDURE.analyse(taken, params, context))
    true = [launch_truth(WorldConfig(truth, bench, seed), 1)[name] for name in TRIAD_NAMES]
    errors = np.concatenate([c.coefficients for c in made]) - np.concatenate([np.column_stack(t).ravel() for t in true])
    more = params.model_copy(update={"terms": ("quadratic",)})
    (extended,) = PROCEDURE.analyse(taken, more, context).extended
    return errors / np.concatenate([c.standard_uncertainties for c in made]), sum(t.present for t in extended.terms)


def main() -> int:
    """Print every coefficient's spread; 1 where one lies outside."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--units", type=int, default=300)
    units = parser.parse_args().units
    found = [one_unit(FIRST_SEED + k) for k in range(units)]
    z, claims = np.array([f[0] for f in found]), sum(f[1] for f in found)
    low, high = (chi2.ppf(p, units) / units for p in (LEVEL / 48, 1.0 - LEVEL / 48))
    squares = np.mean(z**2, axis=0)
    for name, square, worst in zip(NAMES, squares, np.abs(z).max(axis=0), strict=True):
        mark = "" if low < square < high else "  OUTSIDE"
        print(f"{name:24} sd of errors / claimed {np.sqrt(square):.3f}   largest {worst:.2f} sd{mark}")
    most = int(binom.ppf(1.0 - 1e-3, 3 * units, CLAIMED))
    print(f"{units} units; allowed {np.sqrt(low):.3f} … {np.sqrt(high):.3f}")
    print(f"absent K2 claimed {claims} of {3 * units} times, at most {most} by chance")
    return 0 if np.all((low < squares) & (squares < high)) and claims <= most else 1


if __name__ == "__main__":
    sys.exit(main())
