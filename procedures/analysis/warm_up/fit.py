"""Detection and choice of a transient curve in coloured noise: least squares under fitted noise.

The test is a likelihood ratio of one additional shape to the present model, with the noise refitted each time. The new
shape's time exists under one hypothesis only, so the ratio's maximum over it is not chi-square distributed. With γ the
whitened curve of unit length, which runs along an arc of length L, ``P(max > c²) ≈ (L/π)·e^(−c²/2) + P(χ²₁ > c²)``:
Hotelling's tube (Am. J. Math. 61, 1939; Davies, Biometrika 74, 1987, eq. 3.4).
"""

from dataclasses import dataclass, replace
from math import pi

import numpy as np
from scipy.optimize import least_squares
from scipy.special import chdtrc

from procedures.analysis.coloured_noise import CosineSeries, FittedNoise, cosines, fit_noise
from procedures.analysis.warm_up.shapes import Shape, cell_means, exponential, value
from procedures.core.arrays import Array

PER_E_FOLD = 6
"""Grid points per factor e of a time constant."""
SHORTEST, LONGEST = 2.0, 0.5
"""Range of time constants: from `SHORTEST` cells to `LONGEST` of the record; a longer one is a trend."""
_ROUNDS, _SETTLED = 3, 0.1
_STEP, _WORST = 1e-5, 1e11


@dataclass(frozen=True)
class Fit:
    """A sum of shapes under noise; p parameters are each shape's amplitude [rate], then its own ones."""

    shapes: tuple[Shape, ...]
    own: tuple[Array, ...]
    """Parameters of each shape, see `shapes`."""
    amplitudes: Array
    """Amplitudes at the first cell's beginning, (shapes,) [rate]."""
    covariance: Array
    """Covariance of all parameters, shape by shape [amplitude, own…], (p, p)."""
    noise: FittedNoise
    p_value: float
    """Probability that noise and the other shapes alone resemble the last shape as much."""

    @property
    def parameters(self) -> Array:
        """All parameters in the order of `covariance`, (p,)."""
        return np.concatenate([[a, *own] for a, own in zip(self.amplitudes, self.own, strict=True)] or [np.empty(0)])

    def at(self, x: Array) -> Array:
        """Return the transient at times x [s] from the first cell's beginning, shape of x [rate]."""
        return curve(self.shapes, self.parameters, x)

    def cells(self, edges_s: Array) -> Array:
        """Return the means of the transient between neighbouring edges (n+1,) [s] from the first cell's beginning, (n,)
        [rate].
        """
        return means(self.shapes, self.parameters, edges_s)


def curve(shapes: tuple[Shape, ...], parameters: Array, x: Array) -> Array:
    """Return a sum of shapes at times x [s], shape of x; `parameters` as in `Fit`."""
    total, amplitudes, own = np.zeros(x.shape), *_split(shapes, parameters)
    for shape, amplitude, parameter in zip(shapes, amplitudes, own, strict=True):
        total += amplitude * value(shape, x, parameter)
    return total


def means(shapes: tuple[Shape, ...], parameters: Array, edges_s: Array) -> Array:
    """Return the means of a sum of shapes between neighbouring edges (n+1,) [s], (n,); `parameters` as in `Fit`."""
    total, amplitudes, own = np.zeros(len(edges_s) - 1), *_split(shapes, parameters)
    for shape, amplitude, parameter in zip(shapes, amplitudes, own, strict=True):
        total += amplitude * cell_means(shape, edges_s, parameter)
    return total


def _split(shapes: tuple[Shape, ...], parameters: Array) -> tuple[Array, tuple[Array, ...]]:
    parts = np.split(parameters, len(shapes)) if shapes else []
    return np.array([p[0] for p in parts]), tuple(p[1:] for p in parts)


@dataclass(frozen=True)
class Family:
    """One shape of a transient over a grid of its parameter, with the cosines of each."""

    shape: Shape
    grid: Array
    """Grid of the parameter, (m,) [ln s]."""
    columns: Array
    """Cosine coefficients of the shape at each grid point, (n−1, m)."""

    @classmethod
    def over(cls, series: CosineSeries, shape: Shape, shortest: float, longest: float) -> "Family":
        """Return the grid from `shortest` cells to `longest` records, with `PER_E_FOLD` points per factor e."""
        low, high = np.log(shortest * series.cell_s), np.log(longest * series.edges_s[-1])
        grid = np.linspace(low, high, max(2, round(PER_E_FOLD * (high - low))))
        curves = [cell_means(shape, series.edges_s, g[None]) for g in grid]
        return cls(shape, grid, cosines(np.column_stack(curves)))


def exponentials(series: CosineSeries) -> Family:
    """Return the exponentials over the range of time constants."""
    return Family.over(series, exponential, SHORTEST, LONGEST)


def no_transient(series: CosineSeries) -> Fit:
    """Return the fit of noise alone, without any shape."""
    return Fit((), (), np.empty(0), np.empty((0, 0)), fit_noise(series.coefficients, series.unit_variances), 1.0)


def fit_exponentials(series: CosineSeries, significance: float) -> Fit:
    """Return the fit of none, one or two exponentials: each is added if significant, or both at once."""
    family, none = exponentials(series), no_transient(series)
    ones = candidates(series, none, (family,), significance)
    if not ones:
        return pair(series, none, family, significance) or none
    return (*candidates(series, ones[0], (family,), significance), *ones)[0]


def pair(series: CosineSeries, none: Fit, family: Family, significance: float) -> Fit | None:
    """Two of a family at once that are not detectable singly: a transient that turns back. None: not significant.

    The p-value is Bonferroni's over the grid's pairs, each ratio a chi-square's with two degrees of freedom.
    """
    start, noise = _from_grid(series, family, 2, none.noise)
    pairs = len(family.grid) * (len(family.grid) - 1) / 2.0
    p_value = min(1.0, pairs * float(chdtrc(2, max(none.noise.deviance - noise.deviance, 0.0))))
    if p_value > significance:
        return None
    fit = refine(series, noise, (family.shape,) * 2, start)
    return None if fit is None else replace(fit, p_value=p_value)


def noise_left(series: CosineSeries, transient: Array) -> FittedNoise:
    """Return the noise fitted to the residuals of a transient, cell means (n,)."""
    return fit_noise(series.coefficients - cosines(transient), series.unit_variances)


def candidates(series: CosineSeries, fit: Fit, families: tuple[Family, ...], significance: float) -> tuple[Fit, ...]:
    """The likeliest fit of each family with one more shape, where that is significant; the likeliest first.

    All shapes of a fit belong to one family.
    """
    found: list[Fit] = []
    for family in families:
        start, noise = _from_grid(series, family, len(fit.shapes) + 1, fit.noise)
        arcs = sum(_arc_length(series, fit, noise, f) for f in families)
        # the refinement adds far less than one to the grid's likelihood ratio
        if _tube(fit.noise.deviance - noise.deviance + 1.0, arcs) > significance:
            continue
        larger = refine(series, noise, (family.shape,) * (len(fit.shapes) + 1), start)
        p_value = 1.0 if larger is None else _tube(fit.noise.deviance - larger.noise.deviance, arcs)
        if larger is not None and p_value <= significance:
            found.append(replace(larger, p_value=p_value))
    return tuple(sorted(found, key=lambda f: f.noise.deviance))


def _tube(ratio: float, arcs: float) -> float:
    ratio = max(ratio, 0.0)
    return min(1.0, arcs / pi * float(np.exp(-0.5 * ratio)) + float(chdtrc(1, ratio)))


def _from_grid(series: CosineSeries, family: Family, number: int, noise: FittedNoise) -> tuple[Array, FittedNoise]:
    """Alternate between the grid's best curve under the noise and the noise of its residuals until both settle."""
    start = np.empty(0)
    for _ in range(_ROUNDS):
        start, before = _best_start(series, noise, family, number), noise.deviance
        noise = noise_left(series, means((family.shape,) * number, start, series.edges_s))
        if before - noise.deviance < _SETTLED:
            break
    return start, noise


def _best_start(series: CosineSeries, noise: FittedNoise, family: Family, number: int) -> Array:
    """The grid's best point, or pair of points, with its amplitudes; parameters as in `Fit`."""
    white, grid = noise.weights[:, None] * family.columns, family.grid
    projection = (noise.weights * series.coefficients) @ white
    if number == 1:
        squares = np.einsum("ij,ij->j", white, white)
        i = int(np.argmax(projection**2 / squares))
        return np.array([projection[i] / squares[i], grid[i]])
    gram = white.T @ white
    i, j = np.triu_indices(len(grid), 2)
    determinant = gram[i, i] * gram[j, j] - gram[i, j] ** 2
    first = (gram[j, j] * projection[i] - gram[i, j] * projection[j]) / determinant
    second = (gram[i, i] * projection[j] - gram[i, j] * projection[i]) / determinant
    best = int(np.argmax(first * projection[i] + second * projection[j]))
    return np.array([first[best], grid[i[best]], second[best], grid[j[best]]])


def refine(series: CosineSeries, noise: FittedNoise, shapes: tuple[Shape, ...], start: Array) -> Fit | None:
    """Refine a start by Levenberg-Marquardt under given noise; the result's noise is that of the residuals.

    The amplitudes, linear, are eliminated at each step (variable projection; Golub, Pereyra, SIAM J. Numer. Anal. 10,
    1973). None where the curve's parameters cannot be separated from one another.
    """
    weights, observed = noise.weights, noise.weights * series.coefficients
    sizes = [len(o) for o in _split(shapes, start)[1]]

    def columns(own: Array) -> Array:
        parts = np.split(own, np.cumsum(sizes)[:-1])
        curves = [cell_means(s, series.edges_s, o) for s, o in zip(shapes, parts, strict=True)]
        return weights[:, None] * cosines(np.column_stack(curves))

    def residuals(own: Array) -> Array:
        white = columns(own)
        if not np.all(np.isfinite(white)):
            raise np.linalg.LinAlgError("the curve has no finite values")
        return white @ _amplitudes(white, observed) - observed

    first = np.concatenate(_split(shapes, start)[1])
    with np.errstate(all="ignore"):
        try:
            solution = least_squares(
                residuals, first, method="lm", max_nfev=30 * len(first), xtol=1e-4, ftol=1e-6, diff_step=[_STEP]
            )
        except (np.linalg.LinAlgError, ValueError):  # it diverged, to a curve that is flat or vanishes
            return None
        own = np.asarray(solution.x, dtype=np.float64)
        white = columns(own)
        amplitudes = _amplitudes(white, observed)
    parts = tuple(np.split(own, np.cumsum(sizes)[:-1]))
    parameters = np.concatenate([[a, *o] for a, o in zip(amplitudes, parts, strict=True)])
    covariance = _covariance(shapes, parameters, series, weights)
    if covariance is None:
        return None
    left = noise_left(series, means(shapes, parameters, series.edges_s))
    return Fit(shapes, parts, amplitudes, covariance, left, 1.0)


def _amplitudes(white: Array, observed: Array) -> Array:
    return np.asarray(np.linalg.lstsq(white, observed, rcond=None)[0], dtype=np.float64)


def _covariance(shapes: tuple[Shape, ...], parameters: Array, series: CosineSeries, weights: Array) -> Array | None:
    """Inverse of the information JᵀJ of the whitened curve; None where that cannot be inverted."""
    period = len(parameters) // len(shapes)
    largest = float(np.max(np.abs(parameters[::period])))
    sizes = np.where(np.arange(len(parameters)) % period == 0, largest, 1.0)
    if not (np.all(np.isfinite(parameters)) and largest > 0.0):
        return None
    here = means(shapes, parameters, series.edges_s)
    moved = [means(shapes, parameters + _STEP * e, series.edges_s) - here for e in np.diag(sizes)]
    jacobian = weights[:, None] * cosines(np.column_stack(moved)) / _STEP
    information = jacobian.T @ jacobian
    if not np.all(np.isfinite(information)) or np.linalg.cond(information) > _WORST:
        return None
    return np.asarray(np.linalg.inv(information) * np.outer(sizes, sizes), dtype=np.float64)


def _arc_length(series: CosineSeries, fit: Fit, noise: FittedNoise, family: Family) -> float:
    """Length of the arc of a family's whitened curves, of unit length, orthogonal to where the fit itself may move."""
    white = noise.weights[:, None] * family.columns
    tangent: list[Array] = []
    for shape, own in zip(fit.shapes, fit.own, strict=True):
        here = cell_means(shape, series.edges_s, own)
        moved = [cell_means(shape, series.edges_s, own + _STEP * e) for e in np.eye(len(own))]
        tangent += [here, *((m - here) / _STEP for m in moved)]
    if tangent:
        basis = np.linalg.qr(noise.weights[:, None] * cosines(np.column_stack(tangent)))[0]
        white = white - basis @ (basis.T @ white)
    unit = white / np.sqrt(np.einsum("ij,ij->j", white, white))
    cosine = np.einsum("ij,ij->j", unit[:, :-1], unit[:, 1:])
    return float(np.sum(np.arccos(np.clip(np.abs(cosine), 0.0, 1.0))))
