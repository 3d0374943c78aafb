"""Samples that go out corrected for temperature, from a unit whose departures are written out here as a forward model.

At the reference an accelerometer shows V0. Elsewhere it shows ``V = (V0 + B0)/(1 + A/K0) − B0 − B``, A and B being
polynomials of the sensors' departures; a gyro shows ``ω + Σ c_k·ΔT^k``; a sensor at T reads r, where
``T = r − o − s·(r − r0)``.
"""

from typing import Any

import numpy as np
import pytest

from bench_service.formats.export import extract
from bench_service.formats.samples_out.sheet import Sheet, Treatment, physical_sheet
from bench_service.formats.samples_out.sheet_files import SheetFormat, written
from procedures.core.converter import ConverterModel, Normalised
from procedures.core.errors import BadParameter
from procedures.core.imu_model import triad_calibration
from procedures.core.recording import ACCELEROMETER, GYRO, Channel, Quantity, RecordingInfo
from procedures.core.temperature.gyros import GyroPolynomial, GyroThermalCorrection
from procedures.core.temperature.thermometers import SensorCorrection, ThermometerCorrection
from procedures.core.thermal_correction import AxisCorrection, TemperatureRange, ThermalCorrection
from procedures.core.unit_correction import UnitCorrection
from tests.formats.reading import proposed, read

N, RATE = 400, 100.0
SENSORS = ("temperature_case", "temperature_converter", *(f"temperature_gyro_{a}" for a in "xyz"))
_T = np.linspace(0.0, 1.0, N)
CASE, BOARD = 20.0 + 30.0 * _T, 25.0 - 20.0 * _T**2
OWN = np.column_stack([18.0 + 25.0 * _T, 30.0 - 10.0 * _T, 22.0 + 5.0 * _T])
"""Temperatures [°C]: no sensor goes with another."""
FORCES, RATES = np.array([0.3, -9.7, 1.2]), np.array([0.01, -0.02, 0.03])
ALPHA, BETA = (3e-6, 2e-4, -1e-6, 1e-4), (4e-3, 5e-5, -2e-3, 3e-5)
K0, B0, REFERENCE_C = (1.02, 0.97, 1.01), (0.05, -0.03, 0.02), (21.0, 23.0)
DRIFT = ((2e-5, 1e-7), (-1e-5,), ())
READS = {"temperature_converter": (0.4, 0.01), "temperature_gyro_y": (-0.3, -0.02)}
"""Offset and slope of two sensors about 20 °C; the others read right."""
THERMOMETERS = ThermometerCorrection(
    tuple(SensorCorrection(name, *of) for name, of in READS.items()), 20.0, tuple(map(tuple, np.eye(4))), (0.0, 60.0)
)
CHANNELS = (
    *(Channel(name, Quantity.ANGLE_INCREMENT, "rad") for name in GYRO),
    *(Channel(name, Quantity.VELOCITY_INCREMENT, "m/s") for name in ACCELEROMETER),
    *(Channel(name, Quantity.TEMPERATURE, "degC") for name in SENSORS),
)


def thermal(**changes: Any) -> UnitCorrection:
    covered = TemperatureRange((0.0, 50.0), (0.0, 50.0))
    axes = tuple(AxisCorrection(k, b, ALPHA, BETA, *REFERENCE_C) for k, b in zip(K0, B0, strict=True))
    return UnitCorrection("thermal", ThermalCorrection("accelerometer", axes, fitted_range=covered, **changes))


def gyros(**changes: Any) -> UnitCorrection:
    polynomials = [GyroPolynomial(c, tuple(map(tuple, np.eye(len(c))))) for c in DRIFT]
    x, y, z = polynomials
    return UnitCorrection("gyros", GyroThermalCorrection((x, y, z), 20.0, (0.0, 50.0), **changes))


def outputs(own_sensors: bool = False) -> np.ndarray:
    """Samples of the unit as they are stored, (n, 11), by the forward models of above."""
    about = OWN - 20.0
    columns = [RATES[i] + np.polynomial.Polynomial((0.0, *DRIFT[i]))(about[:, i]) for i in range(3)]
    for i in range(3):
        dt, db = (OWN[:, i] if own_sensors else CASE) - REFERENCE_C[0], BOARD - REFERENCE_C[1]
        a = ALPHA[0] * dt**2 + ALPHA[1] * dt + ALPHA[2] * db**2 + ALPHA[3] * db
        b = BETA[0] * dt + BETA[1] * dt**2 + BETA[2] * db + BETA[3] * db**2
        columns.append((FORCES[i] + B0[i]) / (1.0 + a / K0[i]) - B0[i] - b)
    motion = np.column_stack(columns) / RATE
    readings = [CASE, BOARD, *OWN.T]
    for place, name in enumerate(SENSORS):
        offset, slope = READS.get(name, (0.0, 0.0))
        readings[place] = (readings[place] + offset - 20.0 * slope) / (1.0 - slope)
    return np.column_stack([motion, *readings])


def sheet(*corrections: UnitCorrection, own_sensors: bool = False, channels: list[str] | None = None) -> Sheet:
    info = RecordingInfo("r-3", "U-1", CHANNELS, RATE, N)
    part = extract(info, "float64", channels)
    columns = [info.column(c.name) for c in part.info.channels]
    samples = outputs(own_sensors)[:, columns]
    ids = tuple(f"t-{one.kind}" for one in corrections)
    treatment = Treatment(corrections=corrections, correction_ids=ids)
    return physical_sheet(part, [samples[:150], samples[150:]], treatment)


def rows(made: Sheet) -> np.ndarray:
    return np.concatenate([np.column_stack(block)[:, 1:] for block in made.blocks])


@pytest.mark.parametrize("own_sensors", [False, True])
def test_forces_come_back_to_their_reference_temperatures(own_sensors: bool) -> None:
    sensors = "gyros" if own_sensors else "case"
    found = rows(sheet(thermal(thermometers=THERMOMETERS, static_sensors=sensors), own_sensors=own_sensors))
    np.testing.assert_allclose(found[:, 3:6], np.tile(FORCES, (N, 1)), atol=1e-12)
    plain = rows(sheet(own_sensors=own_sensors))
    assert np.abs(plain[:, 3:6] - FORCES).max() > 0.1
    np.testing.assert_array_equal(found[:, [0, 1, 2, *range(6, 11)]], plain[:, [0, 1, 2, *range(6, 11)]])


def test_gyros_and_thermometers_come_back_and_each_goes_by_what_was_recorded() -> None:
    """The thermometers' own correction changes their columns alone: the others have theirs from their fits."""
    known = {"thermometers": THERMOMETERS}
    found = rows(sheet(UnitCorrection("thermometers", THERMOMETERS), gyros(**known), thermal(**known)))
    np.testing.assert_allclose(found[:, :3], np.tile(RATES, (N, 1)), atol=1e-15)
    np.testing.assert_allclose(found[:, 3:6], np.tile(FORCES, (N, 1)), atol=1e-12)
    np.testing.assert_allclose(found[:, 6:], np.column_stack([CASE, BOARD, OWN]), rtol=1e-14)


def test_the_converter_s_drift_is_taken_out() -> None:
    """Its zero drifts by 2e-3 codes/°C at 0.5 codes/mA; c, the accelerometers' nominal current, is 1 mA a m/s² here."""
    from procedures.core.converter import CURRENT_MA_PER_M_S2

    scale = Normalised(True, 23.0, 0.5, (1e-3,), ((0.0, 0.0), (0.0, 0.0)), 0.0)
    zero = Normalised(False, 23.0, 3.0, (2e-3,), ((0.0, 0.0), (0.0, 0.0)), 0.0)
    model = ConverterModel(scale, zero)
    reading = outputs()[:, 7]
    found = rows(sheet(UnitCorrection("converter", (model, model, model))))
    gain, shift = 1.0 + 1e-3 * (reading - 23.0), 2e-3 * (reading - 23.0) / (0.5 * CURRENT_MA_PER_M_S2)
    shown = found[:, 3:6] * gain[:, None] + shift[:, None]
    np.testing.assert_allclose(shown, rows(sheet())[:, 3:6], atol=1e-12)


def test_a_calibration_comes_after_and_the_file_says_both() -> None:
    calibration = triad_calibration(
        "accelerometer", "m/s^2", "m/s^2", np.column_stack([np.ones(3), 2.0 * np.eye(3)]).ravel(), np.zeros((12, 12))
    )
    info = RecordingInfo("r-3", "U-1", CHANNELS, RATE, N, simulated=True)
    part = extract(info, "float64")
    one = thermal(thermometers=THERMOMETERS)
    made = physical_sheet(part, [outputs()], Treatment((calibration,), ("c-1",), 8, (one,), ("t-1",)))
    data = b"".join(written(made, SheetFormat.HDF5))
    proposal = proposed(data, unit=None)
    recording, found = read(data, proposal.description)
    np.testing.assert_allclose(found[:, 3:6], np.tile((FORCES - 1.0) / 2.0, (N // 8, 1)), atol=1e-12)
    assert made.columns[4].attributes["corrected_by"] == "t-1, c-1"
    assert recording.source["exports"][0]["temperature_thermal"] == "t-1"
    assert made.about["fitted_range_thermal"] == "case 0.0 to 50.0 degC, converter 0.0 to 50.0 degC"
    assert any("corrected for temperature by t-1 (thermal)" in words for words in recording.source["warnings"])


def test_what_a_correction_cannot_go_by_is_refused() -> None:
    with pytest.raises(BadParameter, match="no temperature_converter here"):
        sheet(thermal(), channels=[*ACCELEROMETER, "temperature_case"])
    with pytest.raises(BadParameter, match="no temperature_gyro_x, temperature_gyro_y"):
        sheet(gyros(), channels=list(GYRO))
    with pytest.raises(BadParameter, match="at most one correction set of each kind"):
        sheet(gyros(), gyros())
    with pytest.raises(BadParameter, match="its sensors' channels: temperature_converter, temperature_gyro_y"):
        sheet(UnitCorrection("thermometers", THERMOMETERS), channels=list(GYRO))
