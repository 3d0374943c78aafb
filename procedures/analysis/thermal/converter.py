"""Stage one: the signal converter with a precision current source over temperature (thesis 3.8–3.17; paper C).

``N± `` are the mean codes at ``±I``: zero ``ΔN = (N⁺ + N⁻)/2`` (3.10), centred code ``N_c = (N⁺ − N⁻)/2`` (3.11), scale
``K = N_c/I`` (3.12), zero at the input ``ΔI = ΔN/K`` (3.13).
"""

from dataclasses import dataclass

import numpy as np

from procedures.core.arrays import Array
from procedures.core.errors import BadParameter, UnfitRecording


@dataclass(frozen=True)
class ZeroAndScale:
    """Zero and scale of thesis 3.10–3.13 at each soak, (n,) each."""

    zero_code: Array
    """Zero code ΔN, (n,)."""
    scale_code_per_ma: Array
    """Scale K of code over current, (n,)."""
    zero_ma: Array
    """Zero at the input ΔI, (n,)."""


def zero_and_scale(current_ma: float, plus_code: Array, minus_code: Array) -> ZeroAndScale:
    """Return zero and scale at each soak from mean codes (n,) at currents ±I [mA]. Raises `BadParameter`,
    `UnfitRecording`.
    """
    if not 0.0 < current_ma < np.inf:
        raise BadParameter("current_ma", current_ma, "finite and above 0")
    if len(plus_code) != len(minus_code) or not np.all(np.isfinite([*plus_code, *minus_code])):
        raise UnfitRecording("a finite mean code at either current is needed of every soak")
    zero, centred = 0.5 * (plus_code + minus_code), 0.5 * (plus_code - minus_code)
    if np.any(centred == 0.0):
        raise UnfitRecording("the converter answers opposite currents with the same code")
    scale = centred / current_ma
    return ZeroAndScale(zero, scale, zero / scale)
