"""The signal converter of one accelerometer channel over temperature (thesis 3.8-3.13, paper C): the model alone.

``N(I, t) = K0·Fc(t)·I + N0 + Fs(t)`` with Fc = 1 and Fs = 0 at the reference, t the converter's own sensor.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from procedures.core import units
from procedures.core.arrays import Array

CURRENT_MA_PER_M_S2 = 1.1 / units.STANDARD_GRAVITY
"""Current of an accelerometer's nominal output: 1.1 mA a standard g (thesis table 1.3)."""


@dataclass(frozen=True)
class Normalised:
    """Normalised function: ``value_0·F(t)`` with F(t_0) = 1 if `relative`, else ``value_0 + F(t)`` with F(t_0) = 0."""

    relative: bool
    reference_c: float
    at_reference: float
    """Value at the reference value_0, in the unit of the values."""
    coefficients: tuple[float, ...]
    """a_1 … a_q of F, in 1/°C^k, or in the unit of the values a °C^k."""
    covariance: tuple[tuple[float, ...], ...]
    """Covariance of value_0, a_1 … a_q, (q + 1, q + 1)."""
    residual_sd: float

    def function(self, temperature_c: Array) -> Array:
        """Return F at temperatures (n,) [°C]: 1 or 0 at the reference."""
        departure = temperature_c - self.reference_c
        powers = [a * departure ** (k + 1) for k, a in enumerate(self.coefficients)]
        return np.sum(powers, axis=0) + (1.0 if self.relative else 0.0)

    def value(self, temperature_c: Array) -> Array:
        """Return the whole value at temperatures (n,) [°C], (n,)."""
        f = self.function(temperature_c)
        return self.at_reference * f if self.relative else self.at_reference + f

    def largest_change(self, low_c: float, high_c: float) -> float:
        """Return the largest change from the reference within a range [°C], in the unit of the values (Δmax of paper
        C).
        """
        grid = np.linspace(low_c, high_c, 1001)
        return float(np.max(np.abs(self.value(grid) - self.at_reference)))


@dataclass(frozen=True)
class ConverterModel:
    """``N(I, t) = K0·Fc(t)·I + N0 + Fs(t)`` of one channel, t its own sensor's reading."""

    scale: Normalised
    """Scale K0 [codes a mA] and Fc."""
    zero: Normalised
    """Zero N0 [codes] and Fs, the change."""

    def code(self, current_ma: ArrayLike, temperature_c: Array) -> Array:
        """Return the output codes of the channel before rounding, (n,), at temperatures (n,) [°C]."""
        return self.scale.value(temperature_c) * np.asarray(current_ma) + self.zero.value(temperature_c)

    def current_ma(self, code: Array, temperature_c: Array) -> Array:
        """Return the input currents [mA] that give codes (n,) at temperatures (n,) [°C]: the inverse of `code`."""
        return (code - self.zero.value(temperature_c)) / self.scale.value(temperature_c)


ConverterTriad = tuple[ConverterModel, ConverterModel, ConverterModel]
"""The channels x, y, z."""


def at_reference(
    output_m_s2: Array, converter_c: Array, models: ConverterTriad, ma_per_m_s2: float = CURRENT_MA_PER_M_S2
) -> Array:
    """Stage one (paper C): nominal outputs as if the converter had stood at its models' references, (n, 3) [m/s²].

    ``V₁ = (V − Fs(t)/(K0·c))/Fc(t)``: the departure of zero and scale is taken out; what they are at the reference, N0
    and K0, stays, because a calibration of the assembled unit finds it as a part of its bias and scale factor.

    `output_m_s2` nominal outputs (n, 3); `converter_c` the converter's own sensor (n,) [°C]; `ma_per_m_s2` c, the
    accelerometers' nominal current.
    """
    columns = [
        (output_m_s2[:, i] - m.zero.function(converter_c) / (m.scale.at_reference * ma_per_m_s2))
        / m.scale.function(converter_c)
        for i, m in enumerate(models)
    ]
    return np.column_stack(columns)
