"""Thermal correction of an accelerometer triad: thesis 4.1, and its older single model as a case of it.

``Ṽ = [K0 + α1·Δt² + α2·Δt + α3·Δb² + α4·Δb]·(V + B0 + β1·Δt + β2·Δt² + β3·Δb + β4·Δb²)``,
Δt the case (or gyro) sensor and Δb the converter's, both from the temperatures of the standard calibration. Which of
the terms act, and when, is the *form*:

* ``both``: all of them always, thesis 4.1 as it is printed. In a soak both sensors go together and only their sum
  matters; on a ramp the converter lags behind the case, and the difference carries the dynamic error.
* ``switched``: thesis 3.19: those of Δt in the static regime, those of Δb in the dynamic one, which is a function of
  its own and so has constants of its own in addition to K0 and B0.
* ``single``: thesis 3.15: those of Δb alone, in either regime.

Thesis table 4.4 prints α3 four thousand times larger than α4, though thesis 4.1 gives α3 to Δb²: there the two names
are swapped. This module names them as thesis 4.1 does.
"""

from dataclasses import dataclass
from enum import StrEnum
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike

from procedures.core.arrays import Array
from procedures.core.converter import ConverterTriad, at_reference
from procedures.core.errors import BadParameter
from procedures.core.temperature.thermometers import ThermometerCorrection

ALPHAS = ("alpha_1", "alpha_2", "alpha_3", "alpha_4")
BETAS = ("beta_1", "beta_2", "beta_3", "beta_4")
COEFFICIENTS = (*ALPHAS, *BETAS)
POWERS_OF_ALPHA = ((0, 2), (0, 1), (1, 2), (1, 1))
"""Sensor (0 case, 1 converter) and power of each α, in thesis 4.1's order; β is not printed in the same order."""
POWERS_OF_BETA = ((0, 1), (0, 2), (1, 1), (1, 2))


class Form(StrEnum):
    """Form of the correction: the terms of thesis 4.1 that act in each regime."""

    BOTH = "both"
    SWITCHED = "switched"
    SINGLE = "single"


def acting(form: Form, dynamic: ArrayLike) -> tuple[Array, Array]:
    """Return the weights, 0 or 1, of the terms of Δt and of those of Δb, each of the shape of `dynamic`."""
    is_dynamic = np.asarray(dynamic, dtype=np.float64)
    if form is Form.BOTH:
        return np.ones_like(is_dynamic), np.ones_like(is_dynamic)
    if form is Form.SINGLE:
        return np.zeros_like(is_dynamic), np.ones_like(is_dynamic)
    return 1.0 - is_dynamic, is_dynamic


def terms(form: Form, powers: tuple[tuple[int, int], ...], dt: Array, db: Array, dynamic: ArrayLike) -> Array:
    """Return the columns that the coefficients multiply, (n, len(powers)) [°C or °C²]; `dt` and `db` (n,) [°C]."""
    weights = acting(form, dynamic)
    return np.column_stack([weights[s] * (dt, db)[s] ** p for s, p in powers])


@dataclass(frozen=True)
class AxisCorrection:
    """Thesis 4.1 of one accelerometer. α in 1/°C (α2, α4) and 1/°C², β in m/s² a °C (β1, β3) and a °C²."""

    scale: float
    """K0, m/s² a m/s² of nominal output."""
    bias_m_s2: float
    """Offset B0, which is *added*: minus the output at zero input, at the reference temperatures."""
    alpha: tuple[float, float, float, float] = (0.0, 0.0, 0.0, 0.0)
    beta: tuple[float, float, float, float] = (0.0, 0.0, 0.0, 0.0)
    case_reference_c: float = 20.0
    """Reading of the case (gyro) sensor at the standard calibration."""
    converter_reference_c: float = 20.0
    form: Form = Form.BOTH
    dynamic_offset: tuple[float, float] = (0.0, 0.0)
    """Change of K0 and B0 in the dynamic regime, for the form ``switched`` alone."""
    covariance: tuple[tuple[float, ...], ...] = ()
    """Covariance of α1 … α4, β1 … β4, (8, 8); rows of what the form does not use are zero. Empty: not known."""

    def __post_init__(self) -> None:
        numbers = np.array([self.scale, self.bias_m_s2, *self.alpha, *self.beta, *self.dynamic_offset])
        references = (self.case_reference_c, self.converter_reference_c)
        if len(numbers) != 12 or not np.all(np.isfinite(numbers)) or not np.all(np.isfinite(references)):
            raise BadParameter(
                "correction", numbers.tolist(), "K0, B0, four α, four β, two offsets and two references, all finite"
            )
        if self.covariance and np.shape(self.covariance) != (8, 8):
            raise BadParameter("covariance", np.shape(self.covariance), "(8, 8)")

    def standard_uncertainties(self) -> Array:
        """Return the standard uncertainties of α1 … α4, β1 … β4, (8,). Raises `BadParameter` where no covariance is
        known.
        """
        if not self.covariance:
            raise BadParameter("covariance", self.covariance, "a known one, (8, 8): the uncertainties come from it")
        return np.sqrt(np.diagonal(np.array(self.covariance)))

    def apply(self, output_m_s2: ArrayLike, case_c: ArrayLike, converter_c: ArrayLike, dynamic: ArrayLike) -> Array:
        """Return the corrected specific force [m/s²] of nominal outputs at sensor temperatures [°C], all (n,) or
        numbers.
        """
        v, t, b, s = np.broadcast_arrays(
            *(np.atleast_1d(np.asarray(x, dtype=np.float64)) for x in (output_m_s2, case_c, converter_c, dynamic))
        )
        dt, db = t - self.case_reference_c, b - self.converter_reference_c
        scale = self.scale + terms(self.form, POWERS_OF_ALPHA, dt, db, s) @ np.array(self.alpha)
        bias = self.bias_m_s2 + terms(self.form, POWERS_OF_BETA, dt, db, s) @ np.array(self.beta)
        if self.form is Form.SWITCHED:
            scale, bias = scale + s * self.dynamic_offset[0], bias + s * self.dynamic_offset[1]
        return scale * (v + bias)


EXTRAPOLATED_C = 1.0
"""Readings so far beyond the fitted range are worth a word."""


@dataclass(frozen=True)
class TemperatureRange:
    """Readings of the two sensors, least and greatest, between which a correction was fitted [°C]."""

    case_c: tuple[float, float]
    converter_c: tuple[float, float]

    def __post_init__(self) -> None:
        """Check the ends of both ranges. Raises `BadParameter`."""
        for name, (low, high) in (("case_c", self.case_c), ("converter_c", self.converter_c)):
            if not (np.isfinite([low, high]).all() and low <= high):
                raise BadParameter(name, (low, high), "two finite temperatures, the lower one first")

    def beyond_c(self, case_c: ArrayLike, converter_c: ArrayLike) -> Array:
        """Return the distance of readings outside the range, of the farther sensor; zero inside; shape of the readings
        [°C].
        """
        found = [
            np.maximum(low - np.asarray(t, dtype=np.float64), np.asarray(t, dtype=np.float64) - high)
            for t, (low, high) in ((case_c, self.case_c), (converter_c, self.converter_c))
        ]
        if found[0].ndim == 2:  # a sensor for each axis: the farthest counts
            found[0] = found[0].max(axis=1)
        return np.asarray(np.maximum(np.maximum(found[0], found[1]), 0.0), dtype=np.float64)

    def __str__(self) -> str:
        (a, b), (c, d) = self.case_c, self.converter_c
        return f"case {a:.1f} … {b:.1f} °C, converter {c:.1f} … {d:.1f} °C"


@dataclass(frozen=True)
class ThermalCorrection:
    """Thesis 4.1 of a triad, x, y, z."""

    triad: str
    axes: tuple[AxisCorrection, AxisCorrection, AxisCorrection]
    first_stage: ConverterTriad | None = None
    """The converter's models that were taken out of the outputs before the fit, and so must be wherever the correction
    is used; None: it is for outputs as they are. The reference of the whole is then these models' for the converter's
    own drift, and the axes' for the rest: best the same."""
    fitted_range: TemperatureRange | None = None
    """Temperature range of the fit; beyond it the correction extrapolates. None: not known (older versions)."""
    thermometers: ThermometerCorrection | None = None
    """Correction of the sensors that was taken out of their readings before the fit, and so must be wherever the
    correction is used: its temperatures are then temperatures. None: they are readings."""
    static_sensors: Literal["case", "gyros"] = "case"
    """Sensor of the static terms: the case's for all axes, or the thermometer of each axis' own gyro (thesis 4.1)."""

    @property
    def scales(self) -> Array:
        """Scale K0 of each axis, (3,)."""
        return np.array([axis.scale for axis in self.axes])

    def apply(self, output_m_s2: Array, case_c: Array, converter_c: Array, dynamic: ArrayLike) -> Array:
        """Return corrected specific forces (n, 3) [m/s²] of nominal outputs (n, 3).

        `case_c` is (n,), or (n, 3) where each axis has a sensor of its own; `converter_c` (n,) [°C]; `dynamic` (n,) or
        one answer for all.
        """
        own = case_c if case_c.ndim == 2 else np.repeat(case_c[:, None], 3, axis=1)
        columns = [a.apply(output_m_s2[:, i], own[:, i], converter_c, dynamic) for i, a in enumerate(self.axes)]
        return np.column_stack(columns)

    def staged(self, output_m_s2: Array, converter_c: Array) -> Array:
        """Return outputs (n, 3) [m/s²] without the converter's own drift, by its models; without models as they are.
        `converter_c` (n,) [°C].
        """
        stage = self.first_stage
        return output_m_s2 if stage is None else at_reference(output_m_s2, converter_c, stage)

    def at_reference(self, output_m_s2: Array, case_c: Array, converter_c: Array) -> Array:
        """Return what the channels would have shown at the reference temperatures, (n, 3) [m/s²]: ``Ṽ/K0 − B0``.

        The converter's own models are taken out first where the fit had them taken out; the form ``switched`` is in its
        static regime. Arguments as of `apply`.
        """
        felt = self.apply(self.staged(output_m_s2, converter_c), case_c, converter_c, 0.0)
        return felt / self.scales - np.array([axis.bias_m_s2 for axis in self.axes])
