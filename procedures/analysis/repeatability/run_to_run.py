"""Change of bias and scale factor from launch to launch, from several calibrations (thesis 5.2, 5.3)."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.special import chdtri

from procedures.core.arrays import Array
from procedures.core.errors import BadParameter
from procedures.core.imu_model import TriadCalibration


@dataclass(frozen=True)
class Scatter:
    """Sample standard deviation of one coefficient over n calibrations."""

    triad: str
    name: str
    """"bias x", "scale factor x", …"""
    unit: str
    """The bias's unit, or "1" for a scale factor: relative to its mean."""
    mean: float
    sd: float
    """``s = √(Σ(x − x̄)²/(n − 1))``."""
    low: float
    """Lower end of the 95 % interval of the true standard deviation (chi-square, n − 1 degrees of freedom)."""
    high: float
    """Upper end of the 95 % interval of the true standard deviation (chi-square, n − 1 degrees of freedom)."""
    expected_from_measurement: float
    """Standard deviation expected from the calibrations' uncertainties for a stable unit; an upper figure, since the
    constant flaws of one table repeat."""
    values: tuple[float, ...] = ()
    """The coefficient in each calibration."""
    value_sds: tuple[float, ...] = ()
    """Standard uncertainty of each of `values`."""

    def resolves(self, limit: float) -> bool:
        """Return whether the measurement is finer than a limit on the standard deviation."""
        return self.expected_from_measurement < limit


def run_to_run(calibrations: Sequence[TriadCalibration]) -> tuple[Scatter, ...]:
    """Return the scatter of the three biases and the three scale factors of one triad over at least two calibrations.

    Bias in its own unit, scale factor K_ii relative to its mean (thesis 5.2, 5.3). A calibration of the scalar kind has
    other axes than a linear one, so the two are not mixed. Raises `BadParameter` for fewer than two, and for
    calibrations of different triads, units or models.
    """
    if len(calibrations) < 2:
        raise BadParameter("calibrations", len(calibrations), "at least two of a triad are needed")
    for attribute in ("triad", "output_unit", "input_unit", "model"):
        found = sorted({str(getattr(c, attribute)) for c in calibrations})
        if len(found) > 1:
            raise BadParameter("calibrations", ", ".join(found), f"all must have the same {attribute}")
    first = calibrations[0]
    coefficients = np.array([c.coefficients for c in calibrations])
    variances = np.array([np.diagonal(c.covariance_array) for c in calibrations])
    scatters: list[Scatter] = []
    for kind, unit, columns in (("bias", first.output_unit, (0, 4, 8)), ("scale factor", "1", (1, 6, 11))):
        for axis, column in zip("xyz", columns, strict=True):
            size = 1.0 if kind == "bias" else float(np.mean(coefficients[:, column]))
            values, sds = coefficients[:, column], np.sqrt(variances[:, column])
            scatter = _scatter(values, sds, size)
            each = (tuple(values.tolist()), tuple(sds.tolist()))
            scatters.append(Scatter(first.triad, f"{kind} {axis}", unit, *scatter, *each))
    return tuple(scatters)


def _scatter(values: Array, sds: Array, size: float) -> tuple[float, float, float, float, float]:
    """Mean, sd, its 95 % interval, and the sd that measurement alone would give; all but the mean divided by |size|."""
    sd = float(np.std(values, ddof=1)) / abs(size)
    low, high = sd_interval(sd, len(values))
    return float(np.mean(values)), sd, low, high, float(np.sqrt(np.mean(sds**2))) / abs(size)


def sd_interval(sd: float, n: int, confidence: float = 0.95) -> tuple[float, float]:
    """Return the interval of the true standard deviation given that of n Gaussian values, ``s·√((n − 1)/χ²)``."""
    tail = 0.5 * (1.0 - confidence)
    low, high = float(chdtri(n - 1, tail)), float(chdtri(n - 1, 1.0 - tail))
    return sd * float(np.sqrt((n - 1) / low)), sd * float(np.sqrt((n - 1) / high))
