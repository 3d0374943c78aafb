"""Correction of gyros that depend on temperature, from the runs of a cycle; tested on runs that it has not seen."""

from collections.abc import Sequence
from math import log

import numpy as np
from scipy.special import chdtrc

from procedures.analysis.thermal.correlated import LinearFit, fit_linear, whiten
from procedures.analysis.thermal.correlation import correlation
from procedures.analysis.thermal.cycle.gyros import SMALLEST_P, in_cells
from procedures.analysis.thermal.cycle.results import GyroCorrected, GyroTemperature
from procedures.analysis.thermal.cycle.runs import CycleSettings, PreparedRun
from procedures.analysis.thermal.order import LARGEST_ORDER, Order, compare_orders
from procedures.analysis.thermal.profile_progress import SENSORS
from procedures.core.arrays import Array
from procedures.core.errors import UnfitRecording
from procedures.core.gyro_thermal import GyroPolynomial, GyroThermalCorrection
from procedures.core.noise import NoiseCoefficients
from procedures.core.recording import AXES
from procedures.core.thermometers import ThermometerCorrection

Cells = tuple[Array, Array]
"""Rates of a gyro and departures of its own sensor from the reference, (n,) each."""


def correct_gyros(
    runs: Sequence[PreparedRun],
    tested: Sequence[GyroTemperature],
    settings: CycleSettings,
    known: Sequence[NoiseCoefficients] | None,
    thermometers: ThermometerCorrection | None,
) -> tuple[GyroThermalCorrection | None, tuple[GyroCorrected, ...]]:
    """Polynomials for the gyros whose p-value is below the level, each order with its reason; None: for none of them.

    What is left is tested by fits to all runs but one, on that one: a fit has no dependence left on its own data.
    """
    polynomials: list[GyroPolynomial] = []
    answers: list[GyroCorrected] = []
    reference = settings.reference_c[0]
    spans: list[Array] = []
    for axis, (name, test) in enumerate(zip(AXES, tested, strict=True)):
        if test.p_value >= settings.level / len(AXES):
            polynomials.append(GyroPolynomial())
            continue
        cells = [_cells(run, axis, settings, reference) for run in runs]
        spans += [t + reference for _, t in cells]
        order = _order(cells, settings.cell_s)
        fit = _fit(cells, order.preferred, settings.cell_s)
        head = len(cells)
        polynomials.append(
            GyroPolynomial(
                tuple(fit.coefficients[head:].tolist()),
                tuple(tuple(row) for row in fit.covariance[head:, head:].tolist()),
            )
        )
        after = _unseen(cells, order.preferred, settings, None if known is None else known[axis])
        answers.append(GyroCorrected(name, order.preferred, order.reason(order.preferred), test.p_value, after))
    if not answers:
        return None, ()
    x, y, z = polynomials
    span = (float(min(s.min() for s in spans)), float(max(s.max() for s in spans)))
    return GyroThermalCorrection((x, y, z), reference, span, thermometers), tuple(answers)


def _cells(run: PreparedRun, axis: int, settings: CycleSettings, reference_c: float) -> Cells:
    first = round(settings.gyro_trim_s / run.series.sample_s)
    sensor = run.series.sensors_c[first:, SENSORS.index(f"temperature_gyro_{AXES[axis]}")]
    rate = run.series.gyro_rad_s[first:, axis]
    own, departure = (in_cells(v, run.series.sample_s, settings.cell_s) for v in (rate, sensor - reference_c))
    return own, departure


def _designs(cells: Sequence[Cells], order: int) -> list[Array]:
    """Intercepts of the runs, then the powers, (n, runs + order) each."""
    found: list[Array] = []
    for run, (_, departure) in enumerate(cells):
        heads = np.zeros((len(departure), len(cells)))
        heads[:, run] = 1.0
        found.append(np.column_stack([heads, departure[:, None] ** np.arange(1, order + 1)]))
    return found


def _fit(cells: Sequence[Cells], order: int, cell_s: float) -> LinearFit:
    rates = [rate for rate, _ in cells]
    return fit_linear(_designs(cells, order), rates, [np.ones(len(r)) for r in rates], cell_s)


def _order(cells: Sequence[Cells], cell_s: float) -> Order:
    """Compare the orders on cells whitened by the noise that the largest leaves: a smaller one's would hold misfit."""
    fit = _fit(cells, LARGEST_ORDER, cell_s)
    if fit.spectrum is None:
        raise UnfitRecording("the gyros follow their temperature exactly: there is no noise to judge an order by")
    designs, rates = _designs(cells, LARGEST_ORDER), [rate for rate, _ in cells]
    columns = np.concatenate([whiten(d, v) for d, v in zip(designs, fit.spectrum.variances, strict=True)])
    values = np.concatenate([whiten(r, v) for r, v in zip(rates, fit.spectrum.variances, strict=True)])
    sets = [list(range(len(cells) + order)) for order in range(1, LARGEST_ORDER + 1)]
    return compare_orders(columns, sets, values, fit.effective_samples, float(len(values)))


def _unseen(
    cells: Sequence[Cells], order: int, settings: CycleSettings, noise: NoiseCoefficients | None
) -> float | None:
    """Joint p-value of what is left in each run by a fit to the others; None with a single run."""
    if len(cells) < 2:
        return None
    total = 0.0
    for k, (rate, departure) in enumerate(cells):
        others = [c for i, c in enumerate(cells) if i != k]
        slopes = _fit(others, order, settings.cell_s).coefficients[len(others) :]
        left = rate - departure[:, None] ** np.arange(1, order + 1) @ slopes
        total -= 2.0 * log(max(correlation(left, departure, settings.cell_s, noise).p_value, SMALLEST_P))
    return float(chdtrc(2 * len(cells), total))
