"""Possible curves of a transient, as means over cells. Time x is counted from the first cell's beginning.

Every shape is 1 at x = 0 and given by its integral from 0, so a cell's mean is exact however long the cell is:

* exponential ``e^(−x/τ)``;
* raised cosine ``½(1 + cos(πx/T))`` until T, then zero;
* straight ``1 − x/T`` until T, then zero;
* ended exponential ``(e^(−cx/T) − e^(−c))/(1 − e^(−c))`` until T, then zero; straight where c is zero.
"""

from collections.abc import Callable

import numpy as np

from procedures.core.arrays import Array

Shape = Callable[[Array, Array], Array]
"""Integral from 0 to x [s] of a shape with some logarithms of times [ln s] and, of the ended exponential, c."""

_STRAIGHT = 1e-2


def exponential(x: Array, parameters: Array) -> Array:
    """Return the integral of an exponential up to x [s]; parameters [ln τ]."""
    tau = np.exp(parameters[0])
    return -tau * np.expm1(-x / tau)


def raised_cosine(x: Array, parameters: Array) -> Array:
    """Return the integral of a raised cosine up to x [s]; parameters [ln T]."""
    end = np.exp(parameters[0])
    u = np.minimum(x / end, 1.0)
    return 0.5 * end * (u + np.sin(np.pi * u) / np.pi)


def straight(x: Array, parameters: Array) -> Array:
    """Return the integral of a straight decline up to x [s]; parameters [ln T]."""
    end = np.exp(parameters[0])
    u = np.minimum(x / end, 1.0)
    return end * u * (1.0 - 0.5 * u)


def ended_exponential(x: Array, parameters: Array) -> Array:
    """Parameters [ln T, c], integral [s]: ``T·[(1 − e^(−cu))/c − u·e^(−c)]/(1 − e^(−c))`` with u = x/T up to 1."""
    end, c = np.exp(parameters[0]), float(parameters[1])
    u = np.minimum(x / end, 1.0)
    if abs(c) < _STRAIGHT:  # both over c, to the second power of it
        upper = u * (1.0 - u / 2.0) + c * u * (u**2 / 6.0 - 0.5) + c**2 * u * (1.0 / 6.0 - u**3 / 24.0)
        return end * upper / (1.0 - c / 2.0 + c**2 / 6.0)
    return end * (-np.expm1(-c * u) / c - u * np.exp(-c)) / -np.expm1(-c)


def cell_means(shape: Shape, edges_s: Array, parameters: Array) -> Array:
    """Return the means of a shape between neighbouring edges (n+1,) [s], (n,)."""
    return np.diff(shape(edges_s, parameters)) / np.diff(edges_s)


def value(shape: Shape, x: Array, parameters: Array) -> Array:
    """Return the shape itself at times x ≥ 0 [s], shape of x."""
    h = 1e-4 * np.exp(parameters[0])
    return (shape(x + h, parameters) - shape(x, parameters)) / h
