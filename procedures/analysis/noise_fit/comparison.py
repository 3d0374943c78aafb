"""Disagreements of the three methods for noise coefficients, as sentences. Numbers are relative, without unit."""

from math import hypot, isfinite

from procedures.analysis.allan.read_off import Line, ReadOff
from procedures.analysis.noise_fit.estimate import PROCESSES, Estimate, NoiseFit

APART = 2.576
"""Standard uncertainties (of both values together) from which on two values disagree: 1 % two-sided."""


def compare(read_off: ReadOff, least_squares: NoiseFit, likelihood: NoiseFit) -> tuple[str, ...]:
    """A sentence for each process where the read-off or the least squares disagree with the likelihood.

    All three use the same samples, so the uncertainty of their difference is overestimated here: a disagreement that is
    reported is real.
    """
    found: list[str] = []
    for process in PROCESSES:
        reference, name = likelihood.of(process), process.replace("_", " ")
        line: Line | None = getattr(read_off, process)
        read = None if line is None else (line.coefficient, line.coefficient_sd)
        found += _sentence(name, "the read-off", read, reference)
        fitted = least_squares.of(process)
        pair = None if fitted.value is None else (fitted.value, fitted.standard_uncertainty or 0.0)
        found += _sentence(name, "least squares", pair, reference)
    return tuple(found)


def _sentence(process: str, method: str, found: tuple[float, float] | None, reference: Estimate) -> list[str]:
    """Describe a disagreement in one sentence; an empty list where there is none."""
    head = f"{process[0].upper()}{process[1:]}: {method}"
    if found is None:
        if reference.value is None:
            return []
        return [f"{head} does not show it, the likelihood does (p = {reference.p_value:.1e})."]
    value, sd = found
    if reference.value is None or reference.standard_uncertainty is None:
        limit = f"{reference.upper_limit / value:.2g} times that" if value > 0.0 else "above that"
        if not isfinite(reference.upper_limit):
            return [f"{head} shows it, the likelihood does not, and gives no finite limit: it is unbounded."]
        return [f"{head} shows it, the likelihood does not; its 95 % limit is {limit} value."]
    apart = abs(value - reference.value) / hypot(sd, reference.standard_uncertainty)
    if apart < APART:
        return []
    ratio = value / reference.value
    return [f"{head} gives {ratio:.3g} times the likelihood's value, {apart:.1f} standard uncertainties apart."]
