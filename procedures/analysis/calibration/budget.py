"""Uncertainty budget of each coefficient: its sources, one row each, whose root sum of squares is what is stated.

A row has the source's value with its distribution and divisor, which make its standard uncertainty value/divisor, u(x).
The sensitivity c carries that into the coefficient: contribution = c·u(x) (JCGM 100:2008, 5.1 and 8). Sources of many
independent parts (a pointing error, drawn at each station) have one value and the sensitivity of all parts together.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np

from procedures.analysis.calibration.multiposition import TriadFit
from procedures.analysis.calibration.station_noise import mean_covariance
from procedures.analysis.calibration.table_errors import TableErrors
from procedures.core import units
from procedures.core.arrays import Array
from procedures.core.coefficient_name import CoefficientName
from procedures.core.imu_model import COEFFICIENT_NAMES, coefficient_unit
from procedures.core.limits import COVERAGE, combined_freedom, coverage_factor
from procedures.core.noise import NoiseCoefficients
from procedures.core.unit import TriadRecord

Distribution = Literal["normal", "rectangular"]
PROCESSES = {
    "random_walk": ("random walk", "·√s"),
    "quantization": ("resolution (quantization)", "·s"),
    "bias_instability": ("bias instability", ""),
    "rate_random_walk": ("rate random walk", "/√s"),
    "rate_ramp": ("rate ramp", "/s"),
}
"""Noise process -> its name in a budget, and what follows the rate's unit in its own."""
OBSERVED = "noise, from the scatter of the recordings"
TABLE = ("orthogonality", "level", "azimuth", "gravity", "pointing", "direction", "mounting", "latitude")


@dataclass(frozen=True)
class Part:
    """Covariance of the station means by one source of uncertainty."""

    source: str
    value: tuple[float, float, float]
    """Value of the source for channels x, y, z."""
    unit: str
    covariance: Array
    """Covariance of the station means, (3, n, n)."""
    distribution: Distribution = "normal"
    divisor: float = 1.0
    degrees_of_freedom: float | None = None


@dataclass(frozen=True)
class BudgetRow:
    """One source of uncertainty of one coefficient: value, distribution, divisor, sensitivity, contribution."""

    source: str
    value: float
    """Value of the source in `unit`: a standard deviation, or the limit of a rectangular distribution."""
    unit: str
    distribution: Distribution
    divisor: float
    sensitivity: float
    """Change of the coefficient [its unit] per `unit` of the source."""
    contribution: float
    """``|c|·u(x)`` in the coefficient's unit."""
    degrees_of_freedom: float | None
    """None: infinite, the value is taken as known."""


@dataclass(frozen=True)
class Budget:
    """Uncertainty budget of one coefficient: rows by source, and the expanded uncertainty."""

    coefficient: CoefficientName
    unit: str
    rows: tuple[BudgetRow, ...]
    standard_uncertainty: float
    """Root sum of squares of the contributions."""
    degrees_of_freedom: float | None
    """Effective degrees of freedom by Welch and Satterthwaite; None: infinite."""
    coverage_factor: float
    expanded_uncertainty: float
    coverage_probability: float = COVERAGE


def noise_parts(record: TriadRecord, windows: Array, rate_unit: str) -> list[Part]:
    """The noise of the station means process by process; their covariances add up to `mean_covariance`.

    A process that no launch showed has the rectangular distribution between 0 and its limit (see the unit's record).
    """
    found: list[Part] = []
    for process, (name, per) in PROCESSES.items():
        alone = [
            NoiseCoefficients(**{process: getattr(n, process)}, flicker_band_s=n.flicker_band_s) for n in record.noise
        ]
        values = [getattr(n, process) for n in alone]
        if not any(values):
            continue
        unseen = all(process in absent for absent in record.not_observed)
        divisor = float(np.sqrt(3.0)) if unseen else 1.0
        x, y, z = (v * divisor for v in values)
        covariance = np.array([mean_covariance(n, windows) for n in alone])
        distribution: Distribution = "rectangular" if unseen else "normal"
        title = f"{name}, not observed" if unseen else name
        found.append(Part(title, (x, y, z), rate_unit + per, covariance, distribution, divisor))
    return found


def observed_part(fit: TriadFit) -> Part:
    """Return the noise where it is not known: of the recordings themselves, scaled to the residuals."""
    x, y, z = np.sqrt(np.mean(np.diagonal(fit.station_noise, axis1=1, axis2=2), axis=1)).tolist()
    freedom = float(max(1, fit.degrees_of_freedom))
    return Part(OBSERVED, (x, y, z), fit.output_unit, fit.station_noise, degrees_of_freedom=freedom)


def thermal_parts(covariances: Mapping[str, Array], unit: str) -> list[Part]:
    """Return the parts of a thermal correction by name; their values are what they leave in a station mean, root mean
    square.
    """
    found: list[Part] = []
    for source, covariance in covariances.items():
        x, y, z = np.sqrt(np.mean(np.diagonal(covariance, axis1=1, axis2=2), axis=1)).tolist()
        found.append(Part(source, (x, y, z), unit, covariance))
    return found


def budgets(fit: TriadFit, parts: Sequence[Part], table: TableErrors) -> tuple[Budget, ...]:
    """Return the budget of each of the twelve coefficients, in their order."""
    of_parts = part_rows(parts, fit.estimator.gain)
    of_table = {s: fit.table.standard_uncertainty(s) for s in TABLE if s in fit.table.source}
    values = {s: declared_value(table, s) for s in of_table}
    found: list[Budget] = []
    for i, name in enumerate(COEFFICIENT_NAMES):
        rows = of_parts[i] + [row_of(s, *values[s], float(c[i])) for s, c in of_table.items() if values[s][0] > 0.0]
        unit = coefficient_unit(name, fit.output_unit, fit.input_unit)
        found.append(budget_of(CoefficientName(fit.triad, name), unit, [r for r in rows if r.value > 0.0]))
    return tuple(found)


def part_rows(parts: Sequence[Part], gain: Array) -> list[list[BudgetRow]]:
    """Return the rows of each coefficient by the parts, through the gain (k, 3, n) from means to coefficients, k/3 a
    channel.
    """
    through = [np.sqrt(np.maximum(np.einsum("kci,cij,kcj->k", gain, p.covariance, gain), 0.0)) for p in parts]
    return [
        [
            row_of(p.source, p.value[channel], p.unit, float(c[i]), p.distribution, p.divisor, p.degrees_of_freedom)
            for p, c in zip(parts, through, strict=True)
        ]
        for i, channel in enumerate(np.repeat(range(3), len(gain) // 3).tolist())
    ]


def budget_of(name: CoefficientName, unit: str, rows: Sequence[BudgetRow]) -> Budget:
    """Return the budget of one coefficient by its rows: root sum of squares, effective degrees of freedom, coverage."""
    total = float(np.sqrt(sum(r.contribution**2 for r in rows)))
    freedom = combined_freedom([(r.contribution, r.degrees_of_freedom) for r in rows]) if total > 0.0 else None
    factor = coverage_factor(COVERAGE, freedom)
    return Budget(name, unit, tuple(rows), total, freedom, factor, factor * total)


def row_of(
    source: str,
    value: float,
    unit: str,
    contribution: float,
    distribution: Distribution = "normal",
    divisor: float = 1.0,
    freedom: float | None = None,
) -> BudgetRow:
    """Return one row of a budget, with the sensitivity that its contribution implies. `freedom`: degrees of freedom of
    the value, None for infinitely many.
    """
    sensitivity = contribution * divisor / value if value > 0.0 else 0.0
    return BudgetRow(source, value, unit, distribution, divisor, sensitivity, contribution, freedom)


def declared_value(table: TableErrors, source: str) -> tuple[float, str]:
    """Return the declared standard deviation of a source of the table, and its unit."""
    if source == "mounting":
        return table.seat_sd_rad / units.ARCSEC, "arcsec"
    sd = float(np.max(table.sd[table.columns(source)]))
    return (sd, "1") if source == "gravity" else (sd / units.ARCSEC, "arcsec")
