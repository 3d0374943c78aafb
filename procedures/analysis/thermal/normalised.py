"""Normalised functions of temperature: zero and scale relative to normal conditions (thesis 3.2.2, paper C).

``N(A, t) = A·K0·Fc(t) + N0 + Fs(t)`` with ``Fc = 1`` and ``Fs = 0`` at the reference, each a polynomial in the
departure from it. C writes the zero's change as its largest in the range times a function of at most one
(`Normalised.largest_change`).
"""

import numpy as np

from procedures.analysis.least_squares.determination import require_full_rank
from procedures.analysis.least_squares.inverse import scaled_pinv
from procedures.core.arrays import Array
from procedures.core.converter import Normalised
from procedures.core.errors import BadParameter, UnfitRecording

NOUGHT, ROUNDING = 3.0, 1e-9
"""A value is no reference within so many of its standard uncertainties, or so small a part of the largest value."""


def fit_normalised(temperature_c: Array, values: Array, reference_c: float, order: int, relative: bool) -> Normalised:
    """Least squares of values (n,) at temperatures (n,) [°C] by a polynomial about the reference.

    Independent errors of equal size are assumed: one value a soak. The covariance of ratios ``a_k = c_k/c_0`` is that
    of first order. Raises `BadParameter`, `UnfitRecording`, `Undetermined`. `relative`: the coefficients are ratios to
    the value at the reference, as of a scale factor.
    """
    if order not in range(1, 7):
        raise BadParameter("order", order, "1 … 6")
    if len(values) != len(temperature_c) or not np.all(np.isfinite([*values, *temperature_c])):
        raise UnfitRecording("a value and a temperature, both finite, are needed of every soak")
    if len(values) < order + 2:
        raise UnfitRecording(f"{len(values)} soaks cannot give a polynomial of order {order} and its uncertainty")
    design = np.vander(temperature_c - reference_c, order + 1, increasing=True)
    names = ["value at the reference", *(f"a_{k}" for k in range(1, order + 1))]
    require_full_rank("the temperature function", design, names)
    inverse = scaled_pinv(design)
    c = inverse @ values
    left = values - design @ c
    variance = float(left @ left) / (len(values) - order - 1)
    covariance = variance * inverse @ inverse.T
    coefficients = c[1:]
    if relative:
        uncertainty = float(np.sqrt(covariance[0, 0]))
        if abs(c[0]) <= max(NOUGHT * uncertainty, ROUNDING * float(np.abs(values).max())):
            raise UnfitRecording(
                f"the value at the reference, {reference_c:g} °C, comes out as {c[0]:.3g} ± {uncertainty:.2g}, zero "
                "within its uncertainty: nothing is relative to it; take absolute coefficients (relative = false), or "
                "another reference temperature"
            )
        jacobian = np.eye(order + 1)
        jacobian[1:, 1:] /= c[0]
        jacobian[1:, 0] = -c[1:] / c[0] ** 2
        covariance, coefficients = jacobian @ covariance @ jacobian.T, c[1:] / c[0]
    rows = tuple(tuple(float(v) for v in row) for row in covariance)
    return Normalised(
        relative, reference_c, float(c[0]), tuple(float(a) for a in coefficients), rows, float(np.sqrt(variance))
    )
