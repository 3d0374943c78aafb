"""Input of the fits from one run of the thermal cycle: cell means of outputs and temperatures, and regimes.

The unit's temperature sensors lag behind what they stand on; where their time constants are known from the data sheet
the lag is taken out to first order, ``T = T_s + τ·dT_s/dt``.
"""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from procedures.analysis.thermal.regime import RegimeSettings, RegimeTrace, regimes
from procedures.core.arrays import Array
from procedures.core.errors import BadParameter, UnfitRecording
from procedures.importing import IMPORTING

AXES = ("x", "y", "z")


def without_lag(reading_c: Array, sample_s: float, lag_s: float, window_s: float = 60.0) -> Array:
    """Temperature at a lagging sensor, (n,) [°C], from its readings (n,): ``T_s + τ·dT_s/dt``.

    The slope is that of a parabola fitted to the window about each sample (Savitzky and Golay); what is left is
    ``τ²·T''/2``. Also what stage one should be given: a converter that drifts 1e-4 m/s²/°C, read 5 s late on a ramp of
    1 °C/min, is 8e-6 m/s² wrong. Raises `BadParameter`, `UnfitRecording`.
    """
    with IMPORTING:
        from scipy.signal import savgol_filter  # with all of scipy's statistics: only where it is called

    if not 0.0 <= lag_s < np.inf:
        raise BadParameter("lag_s", lag_s, "finite and not negative")
    samples = 2 * round(0.5 * window_s / sample_s) + 1
    if samples < 5:
        raise BadParameter("window_s", window_s, f"at least four samples of {sample_s:g} s")
    if len(reading_c) < samples:
        raise UnfitRecording(f"{len(reading_c)} readings are less than a window of {window_s:g} s")
    return reading_c + lag_s * np.asarray(savgol_filter(reading_c, samples, 2, deriv=1, delta=sample_s))


@dataclass(frozen=True)
class ThermalRun:
    """Cell means of one run, one launch with one axis up. All of n cells of `cell_s`."""

    up: int
    """Index of the axis that stands upwards, 0 … 2."""
    cell_s: float
    output_m_s2: Array
    """Nominal outputs of the accelerometers, (n, 3), the converter's own model already taken out (stage one)."""
    case_c: Array
    """Case temperature, (n,); or (n, 3), a sensor for each axis, such as the gyros' (thesis 4.1)."""
    converter_c: Array
    """Sensor on the converter's board, (n,)."""
    dynamic: NDArray[np.bool_]
    """True where any sample of the cell was dynamic, (n,)."""
    force_m_s2: tuple[float, float, float]
    """Specific force along the true input axis of each accelerometer: gravity and zero for an ideal mounting."""

    def case(self, axis: int) -> Array:
        """Return the static regressor of an axis, (n,) [°C]."""
        return self.case_c if self.case_c.ndim == 1 else self.case_c[:, axis]


def thermal_run(
    up: int,
    gravity_m_s2: float,
    sample_s: float,
    series: Mapping[str, Array],
    *,
    cell_s: float = 60.0,
    lag_s: Mapping[str, float] | None = None,
    settings: RegimeSettings | None = None,
    force_m_s2: tuple[float, float, float] | None = None,
    trace: RegimeTrace | None = None,
) -> ThermalRun:
    """Average series of one interval `sample_s` [s] to cells of `cell_s`; an incomplete last cell is left out.

    Parameters
    ----------
    series : "output" (n, 3) [m/s²], "case" (n,) and "converter" (n,) [°C]; "static" (n,) or (n, 3) where another sensor
        than the case's is to explain the static regime (the regime itself is always that of the case).
    lag_s : time constants of the sensors, by the names of `series`; none where not known.
    force_m_s2 : effective specific force along each axis where the mounting or cross-coupling make it differ from
        gravity along `up`: ``(K·f)_i/K_ii`` of a calibration. A horizontal axis that feels 0.05 m/s² of it mixes its
        scale's temperature dependence into its bias.
    trace : regime of every sample where it is known already.

    Raises `BadParameter`, `UnfitRecording` (a value that is no number, a series of another length, no two cells).
    """
    samples = round(cell_s / sample_s)
    if up not in (0, 1, 2):
        raise BadParameter("up", up, "0, 1 or 2")
    if samples < 1 or abs(samples * sample_s - cell_s) > 1e-6 * cell_s:
        raise BadParameter("cell_s", cell_s, f"a whole number of samples of {sample_s:g} s")
    lags = dict(lag_s or {})
    for name, lag in lags.items():
        if name not in series or not 0.0 <= lag < np.inf:
            raise BadParameter(f"lag_s.{name}", lag, "finite, not negative, of a sensor among " + ", ".join(series))
    length = len(series["output"])
    for name, values in series.items():
        if len(values) != length or not np.all(np.isfinite(values)):
            raise UnfitRecording(f"series {name!r}: {len(values)} values where {length} finite ones are needed")
    count = length // samples
    if count < 2:
        raise UnfitRecording(f"{length} samples are less than two cells of {cell_s:g} s")
    dynamic = (trace or regimes(series["case"], sample_s, settings)).dynamic

    def cells(name: str) -> Array:
        values = np.asarray(series[name], dtype=np.float64)
        if name in lags:
            columns = values.reshape(length, -1).T
            values = np.array([without_lag(c, sample_s, lags[name]) for c in columns]).T.reshape(values.shape)
        return values[: count * samples].reshape(count, samples, *values.shape[1:]).mean(axis=1)

    ideal = [gravity_m_s2 if axis == up else 0.0 for axis in range(3)]
    return ThermalRun(
        up,
        cell_s,
        cells("output"),
        cells("static" if "static" in series else "case"),
        cells("converter"),
        np.asarray(dynamic[: count * samples].reshape(count, samples).any(axis=1)),
        force_m_s2 or (ideal[0], ideal[1], ideal[2]),
    )
