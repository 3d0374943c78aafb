"""Chi-square of errors against their covariance, and how likely one as large is."""

from scipy.special import chdtrc

from procedures.analysis.least_squares.whitening import whitener
from procedures.core.arrays import Array


def chi_square(errors: Array, covariance: Array) -> float:
    """Return ``χ² = eᵀC⁻¹e`` of errors (n,) with covariance (n, n); zero of no errors."""
    if len(errors) == 0:
        return 0.0
    whitened = whitener(covariance) @ errors
    return float(whitened @ whitened)


def tail_probability(statistic: float, degrees_of_freedom: int) -> float:
    """Return the probability of a chi-square at least as large, with these degrees of freedom."""
    return float(chdtrc(degrees_of_freedom, statistic))


def residual_factor(statistic: float, degrees_of_freedom: int, noise_known: bool) -> float:
    """Return the factor on the noise's covariance that makes the residuals likely: χ²/ν, never under one, one of known
    noise.
    """
    return 1.0 if noise_known or degrees_of_freedom == 0 else max(1.0, statistic / degrees_of_freedom)


def judged_p_value(statistic: float, degrees_of_freedom: int, noise_known: bool) -> float | None:
    """`tail_probability` of a fit's residuals, or None where it proves nothing.

    That is where as many unknowns as measurements leave no degree of freedom, and where unknown noise was scaled to the
    residuals.
    """
    return tail_probability(statistic, degrees_of_freedom) if noise_known and degrees_of_freedom > 0 else None
