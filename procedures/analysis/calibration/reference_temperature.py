"""Station means of an accelerometer triad at reference temperatures, by the unit's correction (thesis 4.1).

Thesis 4.1 corrects to a force, ``f = [K0 + A]·(V + B0 + B)`` with A and B the polynomials in the temperatures'
departures; at the reference A = B = 0 and ``f = K0·(V₀ + B0)``. So what the channel would have shown there is

``V₀ = [1 + A/K0]·(V + B0 + B) − B0 = Ṽ/K0 − B0``,

for any constants K0 and B0 of this launch, which a calibration estimates. Cross-coupling stays as it is, for A
multiplies all that passes a torquer. An error δ of B0 leaves δ·A/K0, a thousandth of it. The form ``switched`` is taken
in its static regime: a dwell is too short for the indicator. Temperatures are the sensors' means over the dwell, their
lag taken out by their slope, ``T = T_s + τ·dT_s/dt``. The uncertainty of the converter's first stage is in the
correction's own fit; it is not counted twice.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from procedures.analysis.calibration.multiposition import TriadFit
from procedures.analysis.calibration.station_means import StationMeans
from procedures.analysis.cells import cell_means
from procedures.analysis.thermal.gyro_temperatures import GYRO_SENSORS, gyro_temperatures
from procedures.analysis.thermal.regime import RegimeSettings
from procedures.core.arrays import Array
from procedures.core.errors import BadParameter, UnfitRecording
from procedures.core.imu_model import COEFFICIENT_NAMES
from procedures.core.recording import Recording
from procedures.core.temperature.gyros import GyroThermalCorrection
from procedures.core.temperature.thermometers import ThermometerCorrection
from procedures.core.thermal_correction import (
    EXTRAPOLATED_C,
    POWERS_OF_ALPHA,
    POWERS_OF_BETA,
    AxisCorrection,
    Form,
    ThermalCorrection,
    terms,
)
from procedures.core.unit import Unit

SENSORS = ("temperature_case", "temperature_converter")
"""Channels of Δt and Δb."""
CELLS = 12
"""Stretches of a dwell that its temperatures' line is fitted to."""
LEAST_CELL_S = 1.0
"""Interval at which a unit sends its temperatures: once a second."""
LEAST_DWELL_S = 10.0
"""Least dwell for the temperatures of a station: means, slopes, and their scatter [s]."""


def require_correctable(thermal_correction: str, dwell_s: float | None, unit: Unit) -> None:
    """Refuse `thermal_correction` "current" of a unit without one, or with too short a dwell. Raises `BadParameter`."""
    if thermal_correction != "current":
        return
    if unit.thermal_correction is None:
        why = unit.why_withheld("thermal") or (
            f"unit {unit.serial} has no current thermal correction: run a thermal_cycle, or choose one of its history; "
            "one that failed counts only where it is chosen"
        )
        raise BadParameter("thermal_correction", "current", f"none: {why}")
    if dwell_s is not None and dwell_s < LEAST_DWELL_S:
        raise BadParameter("dwell_s", dwell_s, f"at least {LEAST_DWELL_S:g}: temperatures are read at the same time")


def least_dwell_s(thermal_correction: str) -> float:
    """Duration before which no stop rule may end a dwell [s]: that of the temperatures' line, where they are used."""
    return LEAST_DWELL_S if thermal_correction == "current" else 0.0


@dataclass(frozen=True)
class StationTemperatures:
    """Sensors at the middle of each dwell, lag taken out, each (n, m) [°C]: those of Δt, then the converter's."""

    mean_c: Array
    mean_sd_c: Array
    """Standard uncertainty from the scatter about a straight line."""
    slope_c_s: Array

    @property
    def static_c(self) -> Array:
        """Δt's sensor, (n,), or one for each axis, (n, 3)."""
        return self.mean_c[:, 0] if self.mean_c.shape[1] == 2 else self.mean_c[:, :-1]

    @property
    def converter_c(self) -> Array:
        return self.mean_c[:, -1]


@dataclass(frozen=True)
class AtReference:
    """Station means corrected to the reference temperatures, with the uncertainty of that correction."""

    means: StationMeans
    temperatures: StationTemperatures
    change_m_s2: Array
    """Correction added to the outputs, (n, 3)."""
    of_correction: Array
    """Covariance of the outputs from the correction's coefficients, common to all stations, (3, n, n)."""
    of_sensors: Array
    """Covariance of the outputs from the sensors' noise, (3, n, n)."""
    correction: ThermalCorrection

    @property
    def by_cause(self) -> dict[str, Array]:
        """Covariances of the outputs by the names that their causes have in a budget, (3, n, n) each."""
        return {"thermal correction": self.of_correction, "thermometers": self.of_sensors}

    @property
    def covariance(self) -> Array:
        """Covariance from coefficients and sensors together, (3, n, n) [(m/s²)²]."""
        return self.of_correction + self.of_sensors


@dataclass(frozen=True)
class ThermalShare:
    """Effect of the thermal correction on a calibration."""

    form: Form
    regime: str
    """Regime assumed by the form ``switched``: "static"; empty for the other forms, which need none."""
    case_c: tuple[float, ...]
    """Case temperature at each station."""
    converter_c: tuple[float, ...]
    change_m_s2: tuple[tuple[float, ...], ...]
    """Correction added to the outputs x, y, z of each station."""
    from_correction: dict[str, float]
    """Standard uncertainty that the correction's coefficients leave in each calibration coefficient; it is part of
    theirs."""
    from_sensors: dict[str, float]
    """Standard uncertainty due to the temperature sensors' noise."""


def station_temperatures(
    recordings: Sequence[Recording],
    lag_s: tuple[float, float],
    sensors: Sequence[str] = SENSORS,
    thermometers: ThermometerCorrection | None = None,
) -> StationTemperatures:
    """Temperatures of each recording by sensors, the converter's last, corrected by `thermometers` where given.

    `lag_s`: time constants of the sensors of Δt, and of the converter's. Raises `MissingChannel`, `UnfitRecording`,
    `BadParameter`.
    """
    rows: list[tuple[Array, Array, Array]] = []
    for recording in recordings:
        info = recording.info
        cell_s = max(LEAST_CELL_S, info.duration_s / CELLS)
        if info.duration_s < 4.0 * cell_s:
            raise BadParameter("dwell_s", info.duration_s, f"at least {4 * LEAST_CELL_S:g} s: temperatures need a line")
        cells = cell_means(recording, sensors, cell_s)
        count = cells.rates.shape[1]
        about = (np.arange(count) - 0.5 * (count - 1)) * cells.cell_s
        mean = cells.rates.mean(axis=1)
        slope = cells.rates @ about / np.sum(about**2)
        left = cells.rates - mean[:, None] - slope[:, None] * about
        variance = np.sum(left**2, axis=1) / (count - 2)
        lag = np.array([*[lag_s[0]] * (len(sensors) - 1), lag_s[1]])
        sd = np.sqrt(variance * (1.0 / count + lag**2 / np.sum(about**2)))
        rows.append((mean + lag * slope, sd, slope))
    mean_c, sd_c, slope_c_s = (np.array(column) for column in zip(*rows, strict=True))
    if thermometers is not None:
        columns = zip(sensors, mean_c.T, strict=True)
        mean_c = np.column_stack([thermometers.corrected(s, c) if thermometers.has(s) else c for s, c in columns])
    return StationTemperatures(mean_c, sd_c, slope_c_s)


def bring_to_reference(
    recordings: Sequence[Recording], means: StationMeans, correction: ThermalCorrection, lag_s: tuple[float, float]
) -> AtReference:
    """Accelerometer station means at the correction's reference temperatures.

    `lag_s`: time constants of case and converter sensor by their data sheet, as the correction's fit was given them.
    Raises `UnfitRecording` where the outputs are no specific forces, `BadParameter`, `MissingChannel`.
    """
    if means.output_unit != "m/s^2":
        raise UnfitRecording(f"outputs in {means.output_unit} cannot be corrected for temperature: m/s^2 are needed")
    if means.at_reference_c is not None:
        case_c, converter_c = means.at_reference_c
        raise UnfitRecording(
            f"these outputs were already brought to {case_c:g} °C (case) and {converter_c:g} °C (converter): a thermal "
            "correction is applied once"
        )
    sensors = (*GYRO_SENSORS, SENSORS[1]) if correction.static_sensors == "gyros" else SENSORS
    found = station_temperatures(recordings, lag_s, sensors, correction.thermometers)
    case, converter = found.static_c, found.converter_c

    def brought(case_c: Array, converter_c: Array) -> Array:
        return correction.at_reference(means.outputs, case_c, converter_c)

    outputs = brought(case, converter)
    by_sensor = [
        (brought(case + step[0], converter + step[1]) - outputs) / STEP_C for step in ((STEP_C, 0.0), (0.0, STEP_C))
    ]
    spreads = (found.mean_sd_c[:, :-1], found.mean_sd_c[:, -1:])
    of_sensors = np.sum([(d * sd) ** 2 for d, sd in zip(by_sensor, spreads, strict=True)], axis=0)
    first = correction.staged(means.outputs, converter)
    own = [case if case.ndim == 1 else case[:, i] for i in range(3)]
    of_correction = [_of_correction(axis, first[:, i], own[i], converter) for i, axis in enumerate(correction.axes)]
    references = correction.axes[0].case_reference_c, correction.axes[0].converter_reference_c
    return AtReference(
        replace(means, outputs=outputs, at_reference_c=references),
        found,
        outputs - means.outputs,
        np.array(of_correction),
        np.array([np.diag(column) for column in of_sensors.T]),
        correction,
    )


STEP_C = 0.01
"""Step of the differences by temperature [°C]."""


def _of_correction(axis: AxisCorrection, v: Array, case: Array, converter: Array) -> Array:
    """Covariance ``J·Σ·Jᵀ`` (n, n): ``∂V₀/∂α = x·(V + B0 + B)/K0``, ``∂V₀/∂β = (1 + A/K0)·x``, x powers of Δ."""
    if not axis.covariance:
        return np.zeros((len(v), len(v)))
    dt, db = case - axis.case_reference_c, converter - axis.converter_reference_c
    of_a = terms(axis.form, POWERS_OF_ALPHA, dt, db, np.zeros_like(dt))
    of_b = terms(axis.form, POWERS_OF_BETA, dt, db, np.zeros_like(dt))
    gain = 1.0 + of_a @ np.array(axis.alpha) / axis.scale
    through = v + axis.bias_m_s2 + of_b @ np.array(axis.beta)
    jacobian = np.column_stack([of_a * (through / axis.scale)[:, None], of_b * gain[:, None]])
    return jacobian @ np.array(axis.covariance) @ jacobian.T


def gyros_at_reference(
    recordings: Sequence[Recording], means: StationMeans, correction: GyroThermalCorrection
) -> tuple[StationMeans, Array]:
    """Gyro station means ``ω − Σ_k c_k·(T − T_ref)^k``, and the covariance that the coefficients add, (3, n, n). Raises
    `UnfitRecording` where the outputs are no rates, `MissingChannel` without the gyros' sensors.
    """
    if means.output_unit != "rad/s":
        raise UnfitRecording(f"outputs in {means.output_unit} cannot be corrected for temperature: rad/s is needed")
    own = gyro_temperatures(recordings, correction)
    covariance = np.array([correction.covariance(axis, own[:, axis]) for axis in range(3)])
    return replace(means, outputs=correction.apply(means.outputs, own)), covariance


def thermal_share(at: AtReference, fit: TriadFit) -> ThermalShare:
    """Return the effect of the thermal correction on the calibration, through the estimator of the fit."""

    def share(covariance: Array) -> dict[str, float]:
        gain = fit.estimator.gain
        variance = np.einsum("kci,cij,kcj->k", gain, covariance, gain)
        return dict(zip(COEFFICIENT_NAMES, np.sqrt(np.maximum(variance, 0.0)).tolist(), strict=True))

    form = at.correction.axes[0].form
    return ThermalShare(
        form,
        "static" if form is Form.SWITCHED else "",
        tuple(at.temperatures.mean_c[:, :-1].mean(axis=1).tolist()),
        tuple(at.temperatures.converter_c.tolist()),
        tuple(tuple(row) for row in at.change_m_s2.tolist()),
        share(at.of_correction),
        share(at.of_sensors),
    )


def thermal_warnings(at: AtReference) -> tuple[str, ...]:
    """Return warnings about the use of the correction at these temperatures."""
    correction = at.correction
    warnings = _of_range(at.temperatures, correction)
    unknown = [name for name, axis in zip("xyz", correction.axes, strict=True) if not axis.covariance]
    if unknown:
        warnings.append(
            f"the thermal correction of accelerometer {', '.join(unknown)} has no covariance: its share in the "
            "uncertainties is missing"
        )
    fastest = RegimeSettings().release_rate_c_s
    moving = int(np.sum(np.abs(at.temperatures.slope_c_s[:, 0]) > fastest))
    if correction.axes[0].form is Form.SWITCHED and moving:
        warnings.append(
            f"at {moving} stations the case changed faster than {60.0 * fastest:g} °C/min, but the correction of the "
            "form 'switched' was applied as in the static regime: let the unit warm through, or use the form 'both'"
        )
    return tuple(warnings)


def _of_range(temperatures: StationTemperatures, correction: ThermalCorrection) -> list[str]:
    """Warnings where stations lie outside the correction's fitted range, or where it has none."""
    if correction.fitted_range is None:
        return ["the thermal correction does not say at which temperatures it was fitted: it may be extrapolated here"]
    beyond = correction.fitted_range.beyond_c(temperatures.static_c, temperatures.converter_c)
    outside = int(np.sum(beyond > EXTRAPOLATED_C))
    if not outside:
        return []
    return [
        f"at {outside} of {len(beyond)} stations the unit was up to {beyond.max():.1f} K beyond the range in which its "
        f"thermal correction was fitted ({correction.fitted_range}): the correction is extrapolated there, and its "
        "uncertainty does not say by how much it is wrong; calibrate within the range, or repeat the thermal cycle "
        "over the temperatures of use"
    ]
