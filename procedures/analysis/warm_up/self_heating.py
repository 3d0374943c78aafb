"""Self-heating of an accelerometer: its curve under coloured noise, and the signal without it (thesis 3.1.3).

``F(t) = p₁·e^(p₂(t − t₀)) + p₃·e^(p₄(t − t₀)) + p₅`` (thesis 3.3) with t₀ the record's beginning, so p₁ and p₃ are
amplitudes there; for a record from power-up on it is the thesis's own. Found by Levenberg-Marquardt, as there, but with
two differences: the squares are weighted by the noise's spectrum, fitted with the curve (`coloured_noise`), since
flicker would otherwise pass for heat and the uncertainties hold for white noise only; and an exponential is accepted
only where noise, or noise and one exponential, does not explain the record (`warm_up.fit`): two equal ones are one.
"""

from dataclasses import dataclass

import numpy as np

from procedures.analysis.calibration.station_noise import mean_covariance
from procedures.analysis.coloured_noise import cosine_series
from procedures.analysis.warm_up.fit import Fit, fit_exponentials
from procedures.core.arrays import Array
from procedures.core.errors import BadParameter
from procedures.core.noise import NoiseCoefficients

SIGNIFICANCE = 1e-3


@dataclass(frozen=True)
class SelfHeating:
    """A fitted self-heating curve F as plain data; arrays are tuples in the thesis's order."""

    exponentials: int
    """Number of exponentials, 0 to 2; amplitudes and rates of absent ones are zero."""
    parameters: tuple[float, float, float, float, float]
    """p₁ [rate], p₂ [1/s], p₃ [rate], p₄ [1/s], p₅ [rate]; the slower exponential first, p₂ and p₄ negative."""
    covariance: tuple[tuple[float, ...], ...]
    """(5, 5), zero for absent terms. p₅ includes the slow drift of the noise since power-up (`core.noise`)."""
    start_s: float
    """t₀ since power-up [s]."""
    duration_s: float
    p_value: float
    """Probability that noise and the other exponential resemble the last one as much; 1 where there is none."""
    noise: NoiseCoefficients
    """Noise of the record without the curve, by maximum likelihood."""

    @property
    def standard_uncertainties(self) -> Array:
        """Standard uncertainties of the five parameters, (5,)."""
        return np.sqrt(np.diagonal(np.array(self.covariance)))

    def curve(self, t_s: Array) -> Array:
        """Return F at times since power-up [s], shape of `t_s` [rate]."""
        p1, p2, p3, p4, p5 = self.parameters
        x = np.asarray(t_s, dtype=np.float64) - self.start_s
        return p1 * np.exp(p2 * x) + p3 * np.exp(p4 * x) + p5

    def removed(self, cells: Array, cell_s: float) -> Array:
        """Return the fitted cells, (n,), minus F(t) − F(t₀) (thesis 3.4), each F the mean over its cell."""
        edges = np.arange(len(cells) + 1) * cell_s
        heating = np.zeros(len(cells))
        for p, rate in (self.parameters[0:2], self.parameters[2:4]):
            if p != 0.0:
                heating += p * (np.diff(np.expm1(rate * edges)) / (rate * cell_s) - 1.0)
        return cells - heating


def fit_self_heating(
    cells: Array, cell_s: float, start_s: float = 0.0, *, significance: float = SIGNIFICANCE
) -> SelfHeating:
    """Fit the curve to means (n,) [rate] over cells of `cell_s` [s], the first beginning `start_s` [s] after power-up.

    An exponential is accepted if the p-value of its likelihood ratio is below `significance`. Raises `BadParameter` and
    `UnfitRecording`. Series of more than 2048 cells are averaged to no more than that; time constants below two of
    those cells, or far above half the record, are not found.
    """
    if not 0.0 <= start_s < float("inf"):
        raise BadParameter("start_s", start_s, "finite and not negative")
    if not 0.0 < significance < 1.0:
        raise BadParameter("significance", significance, "above 0 and below 1")
    series = cosine_series(cells, cell_s)
    fit = fit_exponentials(series, significance)
    duration = float(series.edges_s[-1])
    means = fit.cells(series.edges_s)
    parameters, covariance = _thesis_order(fit)
    parameters[4] = float(np.mean(series.values - means))
    noise = fit.noise.noise
    by_curve = _mean_gradient(parameters, duration)
    covariance[4, :4] = covariance[:4, 4] = -covariance[:4, :4] @ by_curve
    wander = float(mean_covariance(noise, [[start_s, start_s + duration]])[0, 0])
    covariance[4, 4] = float(by_curve @ covariance[:4, :4] @ by_curve) + wander
    p1, p2, p3, p4, p5 = parameters.tolist()
    return SelfHeating(
        exponentials=len(fit.shapes),
        parameters=(p1, p2, p3, p4, p5),
        covariance=tuple(tuple(row) for row in covariance.tolist()),
        start_s=start_s,
        duration_s=duration,
        p_value=fit.p_value,
        noise=noise,
    )


def _thesis_order(fit: Fit) -> tuple[Array, Array]:
    """p₁…p₄ and their covariance from amplitudes and ln τ, the slower first: ``p₂ = −e^(−ln τ)``; p₅ still zero."""
    parameters, jacobian = np.zeros(5), np.zeros((5, len(fit.parameters)))
    slower_first = sorted(range(len(fit.shapes)), key=lambda i: -float(fit.own[i][0]))
    for place, i in enumerate(slower_first):
        rate = -float(np.exp(-fit.own[i][0]))
        parameters[2 * place : 2 * place + 2] = fit.amplitudes[i], rate
        jacobian[2 * place, 2 * i], jacobian[2 * place + 1, 2 * i + 1] = 1.0, -rate
    return parameters, jacobian @ fit.covariance @ jacobian.T


def _mean_gradient(parameters: Array, duration: float) -> Array:
    """Derivatives of the exponentials' mean over the record by p₁…p₄, (4,)."""
    gradient = np.zeros(4)
    for k in (0, 2):
        amplitude, rate = parameters[k : k + 2]
        if rate != 0.0:
            u = rate * duration
            gradient[k] = np.expm1(u) / u
            gradient[k + 1] = amplitude * (u * np.exp(u) - np.expm1(u)) / (rate * u)
    return gradient
