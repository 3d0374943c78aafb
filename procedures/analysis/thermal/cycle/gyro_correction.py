"""Correction of gyros that depend on temperature, from the runs of a cycle; tested on runs that it has not seen."""

from collections.abc import Sequence

import numpy as np

from procedures.analysis.thermal.cycle.gyros import in_cells
from procedures.analysis.thermal.cycle.results import GyroCorrected, GyroTemperature
from procedures.analysis.thermal.cycle.runs import CycleSettings, PreparedRun
from procedures.analysis.thermal.dependence import Series, fit_order, judge_order, unseen_p_value
from procedures.analysis.thermal.profile_progress import SENSORS
from procedures.core.arrays import Array
from procedures.core.noise import NoiseCoefficients
from procedures.core.recording import AXES
from procedures.core.temperature.gyros import GyroPolynomial, GyroThermalCorrection
from procedures.core.temperature.thermometers import ThermometerCorrection


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
        spans += [c.departure_c + reference for c in cells]
        order = judge_order(cells, settings.cell_s)
        fit = fit_order(cells, order.preferred, settings.cell_s)
        head = len(cells)
        rows = tuple(tuple(row) for row in fit.covariance[head:, head:].tolist())
        polynomials.append(GyroPolynomial(tuple(fit.coefficients[head:].tolist()), rows))
        after = unseen_p_value(cells, order.preferred, settings.cell_s, None if known is None else known[axis])
        answers.append(GyroCorrected(name, order.preferred, order.reason(order.preferred), test.p_value, after))
    if not answers:
        return None, ()
    x, y, z = polynomials
    span = (float(min(s.min() for s in spans)), float(max(s.max() for s in spans)))
    return GyroThermalCorrection((x, y, z), reference, span, thermometers), tuple(answers)


def _cells(run: PreparedRun, axis: int, settings: CycleSettings, reference_c: float) -> Series:
    first = round(settings.gyro_trim_s / run.series.sample_s)
    sensor = run.series.sensors_c[first:, SENSORS.index(f"temperature_gyro_{AXES[axis]}")]
    rate = run.series.gyro_rad_s[first:, axis]
    own, departure = (in_cells(v, run.series.sample_s, settings.cell_s) for v in (rate, sensor - reference_c))
    return Series(own, np.asarray(departure))
