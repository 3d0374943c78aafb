"""Polynomial of a zero or a scale in temperature, from one value a soak."""

from dataclasses import dataclass
from typing import Any

import numpy as np

from procedures.analysis.thermal.normalised import fit_normalised
from procedures.core.arrays import Array
from procedures.core.converter import Normalised
from procedures.core.errors import BadParameter
from procedures.library.arguments import Samples, series
from procedures.library.figure import axes


@dataclass(frozen=True)
class Polynomial:
    """Fitted polynomial of a quantity in temperature, with the soaks that it was fitted to."""

    fit: Normalised
    """Value at the reference, coefficients and their covariance."""
    temperature_c: Array
    values: Array

    def __call__(self, temperature_c: Samples) -> Array:
        """Values at temperatures (n,) [°C]."""
        return self.fit.value(series("temperature_c", temperature_c))

    def sd(self, temperature_c: Samples) -> Array:
        """Return the standard uncertainties of the values at temperatures (n,) [°C], from the covariance of the
        coefficients.
        """
        departure = series("temperature_c", temperature_c) - self.fit.reference_c
        powers = departure[:, None] ** np.arange(1, len(self.fit.coefficients) + 1)
        size = self.fit.at_reference if self.fit.relative else 1.0
        first = self.fit.value(departure + self.fit.reference_c) / self.fit.at_reference if self.fit.relative else 1.0
        gradient = np.column_stack([np.broadcast_to(first, departure.shape), size * powers])
        return np.sqrt(np.einsum("ni,ij,nj->n", gradient, np.asarray(self.fit.covariance), gradient))

    def plot(self, ax: Any = None) -> Any:
        """Draw soaks and polynomial with its standard uncertainty; returns the axes."""
        ax = axes(ax)
        grid = np.linspace(self.temperature_c.min(), self.temperature_c.max(), 201)
        line, sd = self(grid), self.sd(grid)
        ax.plot(self.temperature_c, self.values, "o")
        ax.plot(grid, line)
        ax.fill_between(grid, line - sd, line + sd, alpha=0.2)
        ax.set_xlabel("temperature, °C")
        return ax


def thermal(
    temperature_c: Samples, values: Samples, *, reference_c: float = 20.0, order: int = 2, relative: bool = False
) -> Polynomial:
    """Least squares of one value a soak by a polynomial about a reference temperature (thesis 3.2.2).

    Parameters
    ----------
    temperature_c, values : (n,) each, at least ``order + 2`` soaks. reference_c : [°C]. order : 1 … 6.
    relative : True for a scale factor, whose coefficients are divided by its value at the reference.

    Raises `BadParameter`, `UnfitRecording`, `Undetermined`.
    """
    temperatures, found = series("temperature_c", temperature_c), series("values", values)
    if len(temperatures) != len(found):
        raise BadParameter("values", f"{len(found)} values", f"as many as there are temperatures, {len(temperatures)}")
    if not np.isfinite(reference_c):
        raise BadParameter("reference_c", reference_c, "a finite temperature")
    return Polynomial(fit_normalised(temperatures, found, float(reference_c), order, relative), temperatures, found)
