"""Is a sample of noise fits what it claims to be? Tolerances follow from the sample's size, and from the goals."""

from dataclasses import dataclass

import numpy as np
from scipy.stats import binom, chi2, norm

from procedures.analysis.allan.read_off import ReadOff
from procedures.analysis.noise_fit.estimate import NoiseFit
from simulators.truth import Array
from tests.validation.noise_records import PROCESSES, Scenario

LEVEL = 1e-4
"""Probability that one figure fails by chance; about a hundred are judged."""
COVERAGE = 0.95
EFFICIENCY = 1.25
"""RMSE over the Cramér-Rao bound, at most (a small sample's own spread allowed for)."""
FALSE_ALARMS = 0.02
"""Probability that an absent process comes out, at most: twice the level of the test, which is asymptotic."""
GOAL_FALSE_ALARMS = 0.05
OBSERVABLE = 0.10
"""Relative bound below which a process must be found and known as well as can be."""

Values = tuple[float, float, float, float, float]
"""Value, standard uncertainty, lower, upper, upper limit; NaN where there is none."""
Answer = dict[str, Values]


def from_fit(fit: NoiseFit) -> Answer:
    """Judgement of a fit, way (b) or (c)."""
    answer: Answer = {}
    for process in PROCESSES:
        e = fit.of(process)
        known = (e.value, e.standard_uncertainty, e.lower, e.upper)
        value, sd, lower, upper = (np.nan if v is None else v for v in known)
        answer[process] = (value, sd, lower, upper, e.upper_limit)
    return answer


def from_read_off(lines: ReadOff) -> Answer:
    """Judgement of the read-off, way (a); it has neither interval nor limit."""
    answer: Answer = {}
    for process in PROCESSES:
        line = getattr(lines, process)
        value, sd = (np.nan, np.nan) if line is None else (line.coefficient, line.coefficient_sd)
        answer[process] = (value, sd, np.nan, np.nan, np.nan)
    return answer


@dataclass(frozen=True)
class Outcome:
    """The answers of one method to the records of one scenario."""

    scenario: Scenario
    method: str
    bound: dict[str, float]
    """Relative Cramér-Rao bound."""
    answers: list[Answer]

    @property
    def title(self) -> str:
        """The scenario's."""
        return self.scenario.title

    def values(self, process: str) -> Array:
        """(records, 5)."""
        return np.array([answer[process] for answer in self.answers])


def summary(outcome: Outcome, process: str) -> list[str]:
    """Cells of the table: seen, bias, spread, bound, RMSE/bound, claimed/spread, coverage, limit's coverage."""
    values, true = outcome.values(process), outcome.scenario.of(process)
    seen = values[~np.isnan(values[:, 0])]
    cells = [f"{len(seen)}/{len(values)}"]
    if not true or len(seen) < 2:
        return cells + ["–"] * 7
    error = seen[:, 0] / true - 1.0
    bound, spread = outcome.bound[process], float(np.std(error, ddof=1))
    limits = values[:, 4]
    known = not np.any(np.isnan(seen[:, 2]))
    inside = np.mean((seen[:, 2] <= true) & (true <= seen[:, 3])) if known else np.nan
    return [
        *cells,
        f"{np.mean(error):+.4f}",
        f"{spread:.4f}",
        f"{bound:.4f}",
        f"{np.sqrt(np.mean(error**2)) / bound:.2f}",
        f"{np.mean(seen[:, 1]) / true / spread:.2f}",
        f"{inside:.3f}" if known else "–",
        "–" if np.all(np.isnan(limits)) else f"{np.mean(limits >= true):.3f}",
    ]


def failures(outcome: Outcome) -> list[str]:
    """A sentence for everything outside its tolerance."""
    found: list[str] = []
    for process in PROCESSES:
        name = f"{outcome.title}, {outcome.method}, {process.replace('_', ' ')}"
        if not outcome.scenario.of(process):
            found += _absent(name, outcome.values(process))
        elif outcome.bound[process] < OBSERVABLE:
            values = outcome.values(process) / outcome.scenario.of(process)
            found += _present(name, values, outcome.bound[process])
            if all(bound < OBSERVABLE for bound in outcome.bound.values()):
                found += _biased(name, values, outcome.bound[process])
    return found


def _absent(name: str, values: Array) -> list[str]:
    """Seen too often where it is not."""
    count, seen = len(values), int(np.sum(~np.isnan(values[:, 0])))
    most = max(float(binom.isf(LEVEL, count, FALSE_ALARMS)), GOAL_FALSE_ALARMS * count)
    return [f"{name}: seen in {seen} of {count} records, where it is absent"] if seen > most else []


def _present(name: str, values: Array, bound: float) -> list[str]:
    """Not always seen, too wide, or with intervals that do not hold what they promise."""
    count = len(values)
    if np.any(np.isnan(values[:, 0])):
        return [f"{name}: not seen in {int(np.sum(np.isnan(values[:, 0])))} of {count} records"]
    found: list[str] = []
    error = values[:, 0] - 1.0
    ratio = float(np.sqrt(np.mean(error**2))) / bound
    widest = max(EFFICIENCY, float(np.sqrt(chi2.isf(LEVEL, count) / count)))
    if ratio > widest:
        found.append(f"{name}: RMSE is {ratio:.3f} of the bound, more than {widest:.3f}")
    inside = int(np.sum((values[:, 2] <= 1.0) & (values[:, 3] >= 1.0)))
    low, high = float(binom.ppf(LEVEL / 2, count, COVERAGE)), float(binom.isf(LEVEL / 2, count, COVERAGE))
    if not low <= inside <= high:
        found.append(f"{name}: {inside} of {count} intervals hold the truth, not {low:.0f} … {high:.0f}")
    return found


def _biased(name: str, values: Array, bound: float) -> list[str]:
    """Off on average. Judged where all there is can be observed: one left out as unobserved adds to its neighbours.

    That is in the RMSE too (K of the 60 h scenario: +4 %, 0.4 of its bound, from a flicker of 1.6 of its own).
    """
    error = values[:, 0] - 1.0
    # A root of an unbiased square is low by an eighth of its relative variance: half the coefficient's, bound²/2.
    most = float(norm.isf(LEVEL / 2)) * float(np.std(error, ddof=1)) / np.sqrt(len(values)) + bound**2
    if abs(np.mean(error)) <= most:
        return []
    return [f"{name}: bias {np.mean(error):+.5f}, more than {most:.5f}"]
