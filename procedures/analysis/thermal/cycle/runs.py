"""Preparation of second means for the fits: stage one, lags, regimes, and the force along each accelerometer.

Stage one takes the converter's own drift out of nominal outputs first (paper C; `core.converter.at_reference`).
"""

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from procedures.analysis.thermal.cycle.series import CycleSeries
from procedures.analysis.thermal.fit import fit_correction
from procedures.analysis.thermal.judgement import nearest, soaks
from procedures.analysis.thermal.profile_progress import SENSORS
from procedures.analysis.thermal.regime import RegimeSettings, RegimeTrace, regimes
from procedures.analysis.thermal.runs import ThermalRun, thermal_run, without_lag
from procedures.core.arrays import Array
from procedures.core.converter import ConverterTriad, at_reference
from procedures.core.imu_model import TriadCalibration
from procedures.core.thermal_correction import Form, ThermalCorrection

GYRO_SENSORS = [i for i, name in enumerate(SENSORS) if name.startswith("temperature_gyro_")]
PASSES = 2
"""Number of fits from whose correction each axis's output at the reference, and so its force, is derived."""


@dataclass(frozen=True)
class CycleSettings:
    """Settings of the analysis of a cycle; SI but for °C."""

    cell_s: float = 60.0
    """Length of the cells that the fits work on."""
    case_lag_s: float = 5.0
    converter_lag_s: float | None = 5.0
    """Time constants of the two sensors, by their data sheet; None: the converter's is found from the readings."""
    lag_sd_s: float = 0.05
    """Standard uncertainty of each time constant."""
    converter_lag_sd_s: float | None = None
    """That of the converter's sensor, where it differs."""
    static: Literal["case", "gyros"] = "case"
    """Sensor of the static terms: the case's, or each axis' own gyro's (thesis 4.1)."""
    reference_c: tuple[float, float] = (20.0, 20.0)
    """Readings of case and converter sensor at which the correction changes nothing but K0 and B0."""
    regime: RegimeSettings = field(default_factory=RegimeSettings)
    gyro_trim_s: float = 600.0
    """Start of each launch that the gyros' noise is not judged by (thesis 4.1.1)."""
    level: float = 0.01
    """Significance level of the tests."""
    confidence: float = 0.95
    """Confidence level of the intervals."""

    @property
    def lag_s(self) -> dict[str, float]:
        """Sensor time constants by the names of `thermal_run`; the gyros' sensors are taken as the case's."""
        board = self.case_lag_s if self.converter_lag_s is None else self.converter_lag_s
        return {"case": self.case_lag_s, "static": self.case_lag_s, "converter": board}

    @property
    def lag_sds_s(self) -> tuple[float, float]:
        """Standard uncertainties of the time constants of static and converter sensor."""
        return self.lag_sd_s, self.lag_sd_s if self.converter_lag_sd_s is None else self.converter_lag_sd_s


@dataclass(frozen=True)
class PreparedRun:
    """Data of one run, a row a second and a row a cell."""

    series: CycleSeries
    trace: RegimeTrace
    """The regime of each second."""
    output_m_s2: Array
    """After stage one, (n, 3)."""
    case_c: Array
    """Regressor of the static terms without the sensor's lag, (n,), or (n, 3) by the gyros' sensors."""
    converter_c: Array
    cells: ThermalRun
    other: ThermalRun
    """The same cells with the other choice of the static regressor."""

    @property
    def dynamic(self) -> NDArray[np.bool_]:
        return self.trace.dynamic


def prepare(
    series: CycleSeries, settings: CycleSettings, gravity_m_s2: float, converter: ConverterTriad | None
) -> PreparedRun:
    """Return a run ready to be fitted: lags taken out, regimes found, and gravity along the axis that is up as its
    force.

    `converter`: the models that take the converter's temperature out of the outputs first; None: the outputs are taken
    as they are. Raises `BadParameter`, `UnfitRecording`.
    """
    lags = settings.lag_s
    own = series.sensors_c[:, GYRO_SENSORS]
    case = without_lag(series.case_c, series.sample_s, lags["case"])
    if settings.static == "gyros":
        case = np.column_stack([without_lag(c, series.sample_s, lags["static"]) for c in own.T])
    board = without_lag(series.converter_c, series.sample_s, lags["converter"])
    output = series.output_m_s2
    if converter is not None:
        output = at_reference(output, board, converter)
    trace = regimes(series.case_c, series.sample_s, settings.regime)

    def cells(static: Array) -> ThermalRun:
        given = {"output": output, "case": series.case_c, "static": static, "converter": series.converter_c}
        return thermal_run(
            *(series.up, gravity_m_s2, series.sample_s, given), cell_s=settings.cell_s, lag_s=lags, trace=trace
        )

    by_case, by_gyros = cells(series.case_c), cells(own)
    chosen, other = (by_gyros, by_case) if settings.static == "gyros" else (by_case, by_gyros)
    return PreparedRun(series, trace, output, case, board, chosen, other)


def with_forces(
    runs: Sequence[PreparedRun], settings: CycleSettings, calibration: TriadCalibration
) -> tuple[list[PreparedRun], list[str]]:
    """Return the runs with the force that each accelerometer felt by the unit's calibration (`felt_forces`), and
    warnings.
    """
    cells = felt_forces([r.cells for r in runs], settings.reference_c, calibration)
    runs = [_with_force(run, np.array(cell.force_m_s2)) for run, cell in zip(runs, cells, strict=True)]
    warnings: list[str] = []
    for run in runs:
        others = [f for axis, f in enumerate(run.cells.force_m_s2) if axis != run.series.up]
        if max(map(abs, others)) > LARGEST_TILT * abs(run.cells.force_m_s2[run.series.up]):
            warnings.append(
                f"{run.series.name}: by the unit's calibration its other axes feel "
                f"{', '.join(f'{f:.3g}' for f in others)} m/s²: is it the unit that was calibrated, and was it level?"
            )
    return list(runs), warnings


def felt_forces(
    cells: Sequence[ThermalRun], reference_c: tuple[float, float], calibration: TriadCalibration, form: Form = Form.BOTH
) -> list[ThermalRun]:
    """The cells of each run with the force that each accelerometer felt by the unit's calibration.

    ``f_i = (V_i − b_i)/K_ii`` at the reference temperatures: effective, with what mounting and cross-coupling put into
    it. No soak is quite at the reference, so V there is the nearest soak's output, corrected by a first fit.
    """
    bias, scale = calibration.bias_array, np.diagonal(calibration.matrix_array)
    found = list(cells)
    for _ in range(PASSES):
        correction, _ = fit_correction(found, reference_c, form)
        forces = [((_at_reference(run, correction) - bias) / scale).tolist() for run in found]
        found = [replace(run, force_m_s2=(f[0], f[1], f[2])) for run, f in zip(found, forces, strict=True)]
    return found


LARGEST_TILT = 0.05
"""Greatest share of gravity along a horizontal axis for a seat that counts as level."""


def _at_reference(run: ThermalRun, correction: ThermalCorrection) -> Array:
    """Mean output in the soak nearest to the reference, brought to the reference temperatures, (3,) [m/s²].

    ``V₀ = Ṽ/K0 − B0``: the corrected force through the correction's own constants.
    """
    at = nearest(soaks(run), correction.axes[0].case_reference_c, within_c=np.inf)
    own = slice(at.start, at.stop)
    felt = correction.apply(run.output_m_s2[own], run.case_c[own], run.converter_c[own], run.dynamic[own]).mean(axis=0)
    return np.array([f / a.scale - a.bias_m_s2 for f, a in zip(felt, correction.axes, strict=True)])


def _with_force(run: PreparedRun, force: Array) -> PreparedRun:
    x, y, z = force.tolist()
    cells, other = (replace(c, force_m_s2=(x, y, z)) for c in (run.cells, run.other))
    return replace(run, cells=cells, other=other)
