"""Slope of a quantity over time with an interval that holds for values that resemble their neighbours."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy import stats


@dataclass(frozen=True)
class Slope:
    """A slope and its 95 % interval, in units of the quantity a minute."""

    per_min: float
    low: float
    high: float

    def __str__(self) -> str:
        return f"{self.per_min:+.3f} a minute (95 %: {self.low:+.3f} to {self.high:+.3f})"


def slope(minutes: NDArray[np.float64], values: NDArray[np.float64]) -> Slope:
    """Slope of means over a minute by least squares, its uncertainty by Newey and West.

    `minutes`: times since the begin [min], shape (n,); `values`: shape (n,). At least 8 minutes are needed.
    With residuals e, centred times x and lags up to L, var = Σ_l w_l Σ_t x_t e_t x_{t-l} e_{t-l} / (Σ x²)², weights
    w_l = 1 − l/(L+1), counted twice for l > 0. L = n^(1/2): the automatic rule n^(2/9) is too short for memory, whose
    steps last for minutes. Source: Newey and West, Econometrica 55 (1987) 703. Raises `ValueError`.
    """
    whole = np.floor(minutes).astype(int)
    marks = np.unique(whole)
    if len(marks) < 8:
        raise ValueError(f"{len(marks)} minutes are too few for a slope: 8 are needed")
    x = np.array([minutes[whole == mark].mean() for mark in marks])
    y = np.array([values[whole == mark].mean() for mark in marks])
    x = x - x.mean()
    found = float(x @ y / (x @ x))
    scores = x * (y - y.mean() - found * x)
    lags = int(len(x) ** 0.5)
    total = float(scores @ scores)
    for lag in range(1, lags + 1):
        total += 2.0 * (1.0 - lag / (lags + 1)) * float(scores[lag:] @ scores[:-lag])
    count = len(x)
    error = (max(total, 0.0) * count / (count - 2)) ** 0.5 / float(x @ x)
    reach = float(stats.t.ppf(0.975, count - 2)) * error
    return Slope(found, found - reach, found + reach)
