"""Summary of several launches by channel: mean coefficients, their uncertainty, and the noise to plan with."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from math import isfinite, sqrt

import numpy as np

from procedures.analysis.averaging_time import averaging_time
from procedures.analysis.launch.results import PROCESSES, ChannelNoise, LaunchNoise, Reading
from procedures.core.noise import NoiseCoefficients


@dataclass(frozen=True)
class MeanCoefficient:
    """One noise process over all launches, by the likelihood fit."""

    process: str
    values: tuple[Reading, ...]
    """One reading per launch."""
    mean: float | None
    """Mean over the launches; one that does not show the process counts as zero. None where none shows it."""
    sd: float | None
    """Standard uncertainty of the mean: the greater of that from the fits and that from the scatter of the launches."""


@dataclass(frozen=True)
class ChannelSummary:
    """Summary of one channel over all launches: mean coefficients, averaging time, change of the mean."""

    channel: str
    rate_unit: str
    means: tuple[MeanCoefficient, ...]
    averaging_time_s: float | None
    mean_change_sd: float | None
    """Sample standard deviation (n − 1) of the mean rate over the launches; None for a single launch."""

    def mean(self, process: str) -> MeanCoefficient:
        """Return the mean coefficient of one of the five processes, by its name."""
        return self.means[PROCESSES.index(process)]

    @property
    def noise(self) -> NoiseCoefficients:
        """The noise coefficients to plan with and to weigh with: `effective` of each process."""
        q, n, b, k, r = (effective(m.values) for m in self.means)
        return NoiseCoefficients(q, n, b, k, r)

    @property
    def not_observed(self) -> tuple[str, ...]:
        """Processes that no launch shows: their coefficients in `noise` come from upper limits."""
        return tuple(m.process for m in self.means if m.mean is None)

    def noise_over(self, known: NoiseCoefficients | None) -> NoiseCoefficients:
        """Return the coefficients for a unit's record; one that the model does not describe, or that no launch bounds,
        keeps its `known` value, or limit.
        """
        changed: dict[str, float] = {}
        for m in self.means:
            learnt = all(reading.described for reading in m.values) and not all(r.unbounded for r in m.values)
            if m.mean is None and not learnt:
                limits = [r.upper_limit for r in m.values if r.upper_limit is not None]
                changed[m.process] = min(limits, default=0.0) if known is None else getattr(known, m.process)
        return replace(self.noise, **changed)


def summarise(launches: Sequence[LaunchNoise]) -> tuple[ChannelSummary, ...]:
    """Return the summary of each channel over all launches, in the order of the first launch; a channel must be in
    every launch.
    """
    found: list[ChannelSummary] = []
    for index, first in enumerate(launches[0].channels):
        channels = [launch.channels[index] for launch in launches]
        means = tuple(_mean(process, channels) for process in PROCESSES)
        noise = _coefficients(means)
        rates = [c.mean for c in channels]
        change = float(np.std(rates, ddof=1)) if len(rates) > 1 else None
        found.append(ChannelSummary(first.channel, first.rate_unit, means, _averaging_time_s(noise), change))
    return tuple(found)


def _mean(process: str, channels: Sequence[ChannelNoise]) -> MeanCoefficient:
    readings = tuple(c.coefficient(process).likelihood for c in channels)
    seen = [r for r in readings if r.value is not None]
    if not seen:
        return MeanCoefficient(process, readings, None, None)
    values = [r.value or 0.0 for r in readings]
    n = len(values)
    claimed = sqrt(sum((r.standard_uncertainty or 0.0) ** 2 for r in seen)) / n
    scatter = float(np.std(values, ddof=1)) / sqrt(n) if n > 1 else 0.0
    return MeanCoefficient(process, readings, float(np.mean(values)), max(claimed, scatter))


def effective(readings: Sequence[Reading]) -> float:
    """Coefficient to weigh with: the root of the mean over the launches of the square that each leaves likely.

    A launch that shows the process gives its value. One that does not says that the coefficient lies between 0 and its
    upper limit a: a rectangular distribution, of mean square ``a²/3`` (JCGM 100:2008, 4.3.7). Zero would claim what no
    launch can know: with the noise of thesis table 4.1 six hours rarely show the flicker of gyro x, and a calibration
    that took it for absent was refused by its own chi-square too often. A launch without a finite limit is left out.
    """
    squares = [v**2 for v in (_likely(r) for r in readings) if v is not None]
    return sqrt(float(np.mean(squares))) if squares else 0.0


def _likely(reading: Reading) -> float | None:
    if reading.value is not None:
        return reading.value
    limit = reading.upper_limit
    return None if limit is None or not isfinite(limit) else limit / sqrt(3.0)


def _averaging_time_s(noise: NoiseCoefficients) -> float | None:
    """The averaging time from the mean coefficients; None where quantization dominates nowhere, or everywhere."""
    return averaging_time(noise).tau_s or None


def _coefficients(means: Sequence[MeanCoefficient]) -> NoiseCoefficients:
    """The means as coefficients, in the order of `PROCESSES`; zero where a process was not observed."""
    q, n, b, k, r = (m.mean or 0.0 for m in means)
    return NoiseCoefficients(q, n, b, k, r)
