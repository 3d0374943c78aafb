"""Is a population of calibrations what it claims to be? Every tolerance follows from the sample's size.

The checks of one scenario fail by chance once in a thousand populations, all of them together: each has its share of
that, two-sided. Standard deviations are judged by chi-square, coverage by the binomial distribution. That the counters'
noise is a little flatter than a normal one makes the former conservative.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.stats import binom, chi2, kstest, norm

from procedures.analysis.calibration.reference import TRIAD_NAMES
from procedures.core.imu_model import COEFFICIENT_NAMES
from simulators.truth import Array
from tests.validation.population import Outcome

NAMES = tuple(f"{triad}.{name}" for triad in TRIAD_NAMES for name in COEFFICIENT_NAMES)
FAMILY_LEVEL = 1e-3
CHECKS = 5 * len(NAMES) + 5 * len(TRIAD_NAMES)
LEVEL = FAMILY_LEVEL / CHECKS
"""4.5 standard deviations of a normal figure."""
COVERAGE = 0.95
PREVIEW_TOLERANCE = 0.10
FULL_SIZE = 1000
"""From so many units on the preview's tolerance stands alone; fewer know a spread no better than their number tells."""


@dataclass(frozen=True)
class Column:
    """One figure of every coefficient, (24,), and between which values it must lie; None: for information."""

    title: str
    values: Array
    allowed: tuple[float, float] | None = None

    @property
    def passed(self) -> NDArray[np.bool_]:
        """Which of them lie inside, (24,)."""
        low, high = self.allowed or (-np.inf, np.inf)
        return (self.values >= low) & (self.values <= high)


@dataclass(frozen=True)
class Check:
    """One figure of a whole population."""

    name: str
    value: float
    low: float
    high: float

    @property
    def passed(self) -> bool:
        """Whether it lies inside."""
        return bool(self.low <= self.value <= self.high)


def variance_limits(degrees: float) -> tuple[float, float]:
    """Limits of a mean square with so many degrees of freedom, relative to its expectation."""
    return float(chi2.ppf(LEVEL / 2, degrees) / degrees), float(chi2.isf(LEVEL / 2, degrees) / degrees)


def spread_limits(units: int) -> tuple[float, float]:
    """Limits of a sample standard deviation of so many, relative to the true one."""
    low, high = np.sqrt(variance_limits(units - 1))
    return float(low), float(high)


def preview_limits(units: int) -> tuple[float, float]:
    """Ten per cent; of fewer than the full number of units, what their number allows where that is more."""
    low, high = spread_limits(units) if units < FULL_SIZE else (1.0, 1.0)
    return min(low, 1.0 - PREVIEW_TOLERANCE), max(high, 1.0 + PREVIEW_TOLERANCE)


def columns(population: Outcome) -> list[Column]:
    """Coefficient by coefficient. Each unit's error is taken relative to what was claimed or allowed of that unit."""
    p, units = population, len(population.errors)
    normalised = p.errors / p.claimed
    sigmas, spread = float(norm.isf(LEVEL / 2)), spread_limits(units)
    inside = np.mean(np.abs(normalised) <= norm.isf((1.0 - COVERAGE) / 2), axis=0)
    inside_limits = (float(f(LEVEL / 2, units, COVERAGE)) / units for f in (binom.ppf, binom.isf))

    def ratio(sd: Array) -> Array:
        return np.std(p.errors / sd, axis=0, ddof=1)

    return [
        Column("mean error / its se", normalised.mean(axis=0) * np.sqrt(units), (-sigmas, sigmas)),
        Column("sd / claimed", ratio(p.claimed), spread),
        Column("sd / bound", ratio(p.bound), spread),
        Column("sd / preview", ratio(p.preview), preview_limits(units)),
        Column("in 95 %", inside, tuple(inside_limits)),  # pyright: ignore[reportArgumentType]
        Column("sd / noise bound", ratio(p.noise_bound)),
        Column("sd / thesis bound", ratio(p.weighted_bound)),
        Column("sd / joint bound", ratio(p.joint_bound)),
        Column("sd / first preview", ratio(p.first_preview)),
    ]


def checks(population: Outcome) -> list[Check]:
    """Chi-square of residuals and of verification, and the verified spread against its prediction."""
    return [check for i, triad in enumerate(TRIAD_NAMES) for check in _of_triad(population, i, triad)]


def _of_triad(p: Outcome, i: int, triad: str) -> list[Check]:
    residuals, verified = p.residual_degrees[:, i].sum(), p.verification_degrees[:, i].sum()
    units = len(p.errors)
    # The mean of the ratios has the variance Σ(2/ν)/units²: a chi-square over D = units²/Σ(1/ν) has the same.
    spread = units**2 / np.sum(1.0 / p.spread_degrees[:, i])
    return [
        Check(f"{triad} residuals: mean χ²/dof", p.chi_square[:, i].mean(), *variance_limits(residuals)),
        _uniform(f"{triad} residuals: KS test of p-values", p.p_value[:, i]),
        Check(f"{triad} verification: mean χ²/n", p.verification_chi_square[:, i].mean(), *variance_limits(verified)),
        _uniform(f"{triad} verification: KS test of p-values", p.verification_p_value[:, i]),
        Check(f"{triad} verification: mean s²/predicted", p.spread[:, i].mean(), *variance_limits(spread)),
    ]


@dataclass(frozen=True)
class Misdeclared:
    """Outcome of a triad on tables that are not as declared; the worst and the best of its twelve coefficients."""

    triad: str
    detected: float
    """Part of the units whose residuals' p-value is below the procedure's limit."""
    claimed: tuple[float, float]
    """Least and greatest spread of the errors over what is claimed."""
    noise_bound: tuple[float, float]
    """The same over the Cramér-Rao bound on an ideal table."""


def misdeclared(population: Outcome, p_value_min: float) -> list[Misdeclared]:
    """Triad by triad."""
    p, found = population, []
    for i, triad in enumerate(TRIAD_NAMES):
        own = slice(12 * i, 12 * i + 12)
        claimed, bound = (np.std((p.errors / sd)[:, own], axis=0, ddof=1) for sd in (p.claimed, p.noise_bound))
        detected = float(np.mean(p.p_value[:, i] < p_value_min))
        found.append(Misdeclared(triad, detected, (claimed.min(), claimed.max()), (bound.min(), bound.max())))
    return found


def _uniform(name: str, p_values: Array) -> Check:
    return Check(name, float(kstest(p_values, "uniform").pvalue), LEVEL, 1.0)


def failures(population: Outcome) -> list[str]:
    """A sentence for everything outside its tolerance."""
    found = [
        f"{name}: {column.title} {value:.4g} outside {column.allowed}"
        for column in columns(population)
        for name, value, passed in zip(NAMES, column.values, column.passed, strict=True)
        if not passed
    ]
    outside = [f"{c.name}: {c.value:.4g} outside {c.low:.4g} … {c.high:.4g}" for c in checks(population)]
    return found + [text for text, c in zip(outside, checks(population), strict=True) if not c.passed]
