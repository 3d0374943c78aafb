"""Correction of gyros that depend on their own temperature: a polynomial of each one's own thermometer.

``ω = ω_measured − Σ_k c_k·(T − T_ref)^k``, k from 1. It is one of bias: in a thermal cycle a gyro sees nothing but the
Earth's rate, so that a scale factor's dependence cannot be found.
"""

from dataclasses import dataclass

import numpy as np

from procedures.core.arrays import Array
from procedures.core.errors import BadParameter
from procedures.core.temperature.thermometers import ThermometerCorrection


@dataclass(frozen=True)
class GyroPolynomial:
    """Polynomial of one gyro; empty where it does not depend on temperature."""

    coefficients: tuple[float, ...] = ()
    """Coefficients c_1, c_2, … [rad/s/°C^k]."""
    covariance: tuple[tuple[float, ...], ...] = ()

    def __post_init__(self) -> None:
        order = len(self.coefficients)
        if order > 5 or not np.all(np.isfinite(self.coefficients)):
            raise BadParameter("coefficients", self.coefficients, "at most five, all finite")
        if order and np.shape(self.covariance) != (order, order):
            raise BadParameter("covariance", np.shape(self.covariance), f"({order}, {order})")

    def powers(self, departure_c: Array) -> Array:
        """Return the columns that the coefficients multiply, (n, order), for departures from the reference (n,)
        [°C].
        """
        return departure_c[:, None] ** np.arange(1, len(self.coefficients) + 1)

    def rate(self, departure_c: Array) -> Array:
        """Return the rate that temperature adds, (n,) [rad/s], at departures from the reference (n,) [°C]."""
        return self.powers(departure_c) @ np.array(self.coefficients, dtype=np.float64)


@dataclass(frozen=True)
class GyroThermalCorrection:
    """Polynomials of x, y, z about one reference temperature."""

    gyros: tuple[GyroPolynomial, GyroPolynomial, GyroPolynomial]
    reference_c: float
    fitted_range_c: tuple[float, float]
    """Lowest and highest temperature of the gyros' sensors in the fit."""
    thermometers: ThermometerCorrection | None = None
    """Taken out of the sensors' readings before the fit, and so wherever it is used; None: readings as they are."""

    def apply(self, rates_rad_s: Array, own_c: Array) -> Array:
        """Return rates (n, 3) [rad/s] without what temperature adds, by each gyro's own temperature (n, 3) [°C]."""
        added = [g.rate(own_c[:, i] - self.reference_c) for i, g in enumerate(self.gyros)]
        return rates_rad_s - np.column_stack(added)

    def covariance(self, axis: int, own_c: Array) -> Array:
        """Return the covariance of a gyro's corrected rates at temperatures (n,), (n, n): common to all by the
        coefficients.
        """
        gyro = self.gyros[axis]
        if not gyro.coefficients:
            return np.zeros((len(own_c), len(own_c)))
        powers = gyro.powers(own_c - self.reference_c)
        return powers @ np.array(gyro.covariance) @ powers.T
