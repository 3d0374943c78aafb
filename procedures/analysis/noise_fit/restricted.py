"""Restricted likelihood of a binned spectrum whose modes are normal, independent, and linear in variances.

Modes c of bin b: ``c ~ N(x'β, S_b)``, ``S = A·v``, v ≥ 0 the variances (squares of coefficients), β the regressors'
free amplitudes. With M = ΣG_b/S_b, G the bins' Gram matrices, β = M⁻¹Σ(x'c)_b/S_b, E_b = Σ(c − x'β)², the restricted
log likelihood is ``−½(Σν ln S + ln det M + ΣE/S)`` (Patterson and Thompson, Biometrika 58 (1971) 545). Its gradient
vanishes where v is the least squares solution of ``E_b/ν'_b = (A v)_b`` with weights ``ν'_b/(2S_b²)``, ν' = ν less the
leverage of β: Fisher scoring, each step a non-negative least squares. Independent of the processes.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import brentq, nnls

from procedures.core.arrays import Array

_STEPS = 200
_TOLERANCE = 1e-6
"""A step that promises less log likelihood, ½δ'Fδ, ends the search."""
_SMOOTHED = 9
"""Bins over which the first guess of S is taken."""
_WIDENINGS = 60
_LEAST_SHARE, _MOVED = 1e-6, 0.1
"""A start that explains less than this share of a bin's power is moved inwards, by this part of each single fit."""


@dataclass(frozen=True)
class Spectrum:
    """Bins to fit: sums of squares (b,), degrees of freedom (b,), columns (b, p), products (b, r), Gram (b, r, r)."""

    squares: Array
    dof: Array
    columns: Array
    products: Array
    gram: Array

    @property
    def without_ramp(self) -> "Spectrum":
        """The same bins with all regressors but the first, the ramp."""
        return self.only(range(1, self.products.shape[1]))

    def only(self, regressors: Sequence[int]) -> "Spectrum":
        """Return the same bins with only the regressors of these indices."""
        keep = list(regressors)
        gram = self.gram[:, keep][:, :, keep]
        return Spectrum(self.squares, self.dof, self.columns, self.products[:, keep], gram)


@dataclass(frozen=True)
class State:
    """Quantities that follow from one vector v of variances: power, residual, amplitudes, log likelihoods."""

    variances: Array
    """Variances v, (p,)."""
    power: Array
    """Expected power S, (b,)."""
    residual: Array
    """Residual power E/ν', (b,)."""
    dof: Array
    """Residual degrees of freedom ν', (b,)."""
    amplitudes: Array
    """Regressors' amplitudes β, (r,)."""
    amplitude_covariance: Array
    """Covariance M⁻¹ of the amplitudes, (r, r)."""
    log_likelihood: float
    """Restricted log likelihood; comparable between fits with the same regressors."""
    plain_log_likelihood: float
    """Log likelihood without ln det M; comparable between any fits."""


def state(spectrum: Spectrum, variances: Array) -> State:
    """Return the state at variances v; its log likelihood is −∞ where the power is not positive."""
    s = spectrum
    power = s.columns @ variances
    if not np.all(power > 0.0):
        return _impossible(s, variances)
    flat = s.gram.reshape(len(power), -1)
    weights = 1.0 / power
    try:
        inverse = np.asarray(np.linalg.inv((weights @ flat).reshape(s.gram.shape[1:])), dtype=np.float64)
    except np.linalg.LinAlgError:  # a record without noise: its powers are those of rounding errors
        return _impossible(s, variances)
    beta = inverse @ (weights @ s.products)
    explained = 2.0 * s.products @ beta - flat @ np.outer(beta, beta).ravel()
    squares = np.maximum(s.squares - explained, 0.0)
    dof = np.maximum(s.dof - weights * (flat @ inverse.ravel()), 1e-6 * s.dof)
    plain = -0.5 * float(np.dot(s.dof, np.log(power)) + np.dot(squares, weights))
    determinant = float(np.linalg.det(inverse))
    if not determinant > 0.0:
        return _impossible(s, variances)
    restricted = plain + 0.5 * float(np.log(determinant))
    return State(variances, power, squares / dof, dof, beta, inverse, restricted, plain)


def _impossible(spectrum: Spectrum, variances: Array) -> State:
    """State of a model without power in some bin where the record has power."""
    amplitudes = spectrum.products.shape[1]
    nothing = np.zeros_like(spectrum.dof)
    flat, covariance = np.zeros(amplitudes), np.zeros((amplitudes, amplitudes))
    return State(variances, nothing, nothing, spectrum.dof, flat, covariance, -np.inf, -np.inf)


def information(spectrum: Spectrum, at: State) -> Array:
    """Return the Fisher information of v, ``½ Σν' A_k A_l/S²``, (p, p)."""
    scaled = spectrum.columns / at.power[:, None]
    return 0.5 * (scaled.T * at.dof) @ scaled


def maximum(
    spectrum: Spectrum, free: Sequence[int], held: tuple[int, float] | None = None, start: Array | None = None
) -> State:
    """Return the state of greatest restricted likelihood over the `free` variances; one may be `held` at a value, the
    others are 0. `start`: variances (p,) where the search begins; None: a guess from the spectrum.
    """
    free = [k for k in free if held is None or k != held[0]]
    fixed = np.zeros(spectrum.columns.shape[1])
    if held is not None:
        fixed[held[0]] = held[1]
    if not free:
        return state(spectrum, fixed)
    if start is None:
        guess = _step(spectrum, free, fixed, spectrum.squares / spectrum.dof, spectrum.dof, _smooth(spectrum))
    else:
        guess = fixed.copy()
        guess[free] = start[free]
    best = state(spectrum, _inside(spectrum, free, guess))
    if best.log_likelihood == -np.inf:  # none of the free processes has any power in some bin
        return best
    for _ in range(_STEPS):
        target = _step(spectrum, free, fixed, best.residual, best.dof, best.power)
        if not np.any(target > 0.0):
            break
        change = spectrum.columns @ (target - best.variances) / best.power
        if 0.25 * float(np.dot(best.dof, change**2)) < _TOLERANCE:
            break
        tried = _climb(spectrum, best, target)
        if tried is best:
            break
        best = tried
    return best


def _inside(spectrum: Spectrum, free: list[int], guess: Array) -> Array:
    """The guess, moved off the boundary if it leaves a bin without power: no step leads away from there.

    Least squares set to zero whatever does not contribute to the greatest bins (a low-pass, a lone quantization).
    """
    power = spectrum.columns @ guess
    if np.all(power > _LEAST_SHARE * _smooth(spectrum)):
        return guess
    norm = np.sum(spectrum.dof[:, None] * spectrum.columns[:, free], axis=0)
    moved = guess.copy()
    moved[free] += _MOVED * float(np.sum(spectrum.squares)) / np.where(norm > 0.0, norm, np.inf)
    return moved


def _smooth(spectrum: Spectrum) -> Array:
    kernel = np.ones(min(_SMOOTHED, len(spectrum.dof)))
    return np.convolve(spectrum.squares, kernel, "same") / np.convolve(spectrum.dof, kernel, "same")


def _step(spectrum: Spectrum, free: list[int], fixed: Array, target: Array, dof: Array, power: Array) -> Array:
    """The weighted non-negative least squares step: all variances, (p,)."""
    weight = np.sqrt(dof) / power
    scaled = spectrum.columns[:, free] * weight[:, None]
    norm = np.sqrt(np.sum(scaled**2, axis=0))
    norm[norm == 0.0] = 1.0
    solution = nnls(scaled / norm, (target - spectrum.columns @ fixed) * weight)[0]
    result = fixed.copy()
    result[free] = solution / norm
    return result


def _climb(spectrum: Spectrum, best: State, target: Array) -> State:
    """Step from `best` towards `target` as far as the likelihood grows."""
    part = 1.0
    while part > 1e-4:
        tried = state(spectrum, best.variances + part * (target - best.variances))
        if tried.log_likelihood > best.log_likelihood:
            return tried
        part *= 0.5
    return best


@dataclass
class Profile:
    """Likelihood profile of variance k: twice the loss of log likelihood where it is held fixed and the other `free`
    ones are fitted.
    """

    spectrum: Spectrum
    free: tuple[int, ...]
    k: int
    best: State

    def loss(self, variance: float) -> float:
        """Return twice the loss of log likelihood at one value of variance k."""
        held = maximum(self.spectrum, self.free, (self.k, variance), self.best.variances)
        return 2.0 * (self.best.log_likelihood - held.log_likelihood)

    def crossing(self, loss: float, *, upwards: bool, scale: float) -> float:
        """The variance whose loss equals `loss`, above or below the best one; below it, 0 if the loss at 0 is less.

        `scale` is the variance's standard uncertainty, the first step of the search. Infinite where nothing is lost.
        """
        centre = float(self.best.variances[self.k])
        if not upwards and (centre <= 0.0 or self.loss(0.0) <= loss):
            return 0.0
        near, step = centre, float(scale * np.sqrt(loss))
        for _ in range(_WIDENINGS):
            far = near + step if upwards else near * near / (near + step)
            if self.loss(far) > loss:
                return self._between(min(near, far), max(near, far), loss, nothing=float("inf") if upwards else 0.0)
            near, step = far, 2.0 * step
        return float("inf") if upwards else 0.0

    def _between(self, low: float, high: float, loss: float, nothing: float) -> float:
        """The variance between two whose loss equals `loss`; `nothing` where a held fit does not come back to the best.

        That is so of a record without noise, whose likelihood is one of rounding errors.
        """
        try:
            return float(brentq(lambda v: self.loss(float(v)) - loss, low, high, rtol=1e-4, xtol=1e-4 * high))
        except ValueError:  # the losses at both ends are on one side
            return nothing


def only_where(mask: NDArray[np.bool_], spectrum: Spectrum) -> Spectrum:
    """Return the spectrum of the bins of a mask, (b,)."""
    s = spectrum
    return Spectrum(s.squares[mask], s.dof[mask], s.columns[mask], s.products[mask], s.gram[mask])
