"""Goodness of fit of expected powers to observed ones: normal deviates of bins, and two tests of a group of bins."""

from math import erfc, sqrt

import numpy as np
from scipy.special import chdtrc, gammainc, gammaincc, ndtri

from procedures.analysis.noise_fit.restricted import Spectrum
from procedures.core.arrays import Array

_LARGEST_Z = 38.0
_LEAST_SHARE = 1e-12


def deviates(spectrum: Spectrum, variances: Array, amplitudes: Array) -> Array:
    """Return normal deviates of the bins, (b,): power over expectation is χ²_ν/ν, whose quantile is converted to z."""
    s = spectrum
    explained = 2.0 * s.products @ amplitudes - np.einsum("i,bij,j->b", amplitudes, s.gram, amplitudes)
    expected = s.columns @ variances
    left = np.maximum(s.squares - explained, 0.0)
    # a bin that is not fitted may be one where none of the fitted processes has any power
    ratio = left / np.maximum(expected, _LEAST_SHARE * left + np.finfo(float).tiny)
    half = 0.5 * s.dof
    z = np.where(ratio < s.dof, ndtri(gammainc(half, 0.5 * ratio)), -ndtri(gammaincc(half, 0.5 * ratio)))
    return np.clip(z, -_LARGEST_Z, _LARGEST_Z)


def judged(z: Array) -> tuple[float, int, float]:
    """χ² = Σz² of a group, its degrees of freedom, and a p-value.

    The p-value is twice the lesser of that of χ² and that of the sum, ``Σz/√n`` normal: a slope of the spectrum that
    the model lacks shifts all bins of an octave slightly, to which χ² is insensitive.
    """
    chi_square, count = float(np.sum(z**2)), len(z)
    shift = abs(float(np.sum(z))) / sqrt(count)
    return chi_square, count, min(1.0, 2.0 * min(float(chdtrc(count, chi_square)), erfc(shift / sqrt(2.0))))
