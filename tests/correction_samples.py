"""Correction sets with numbers in every place, drawn: what has to come back as it was; models from bench codes."""

import numpy as np

from procedures.analysis.thermal.converter import zero_and_scale
from procedures.analysis.thermal.normalised import fit_normalised
from procedures.core.arrays import Array
from procedures.core.converter import ConverterModel, Normalised
from procedures.core.temperature.gyros import GyroPolynomial, GyroThermalCorrection
from procedures.core.temperature.thermometers import SensorCorrection, ThermometerCorrection
from procedures.core.thermal_correction import AxisCorrection, Form, ThermalCorrection
from procedures.core.unit_correction import UnitCorrection


def _covariance(rng: np.random.Generator, size: int) -> tuple[tuple[float, ...], ...]:
    root = rng.normal(size=(size, size))
    return tuple(tuple(row) for row in (root @ root.T).tolist())


def _normalised(rng: np.random.Generator, relative: bool) -> Normalised:
    a, b, c = rng.normal(size=3).tolist()
    rows = _covariance(rng, 3)
    return Normalised(relative, 20.25, a, (b, c), rows, 1e-300)


def converter(seed: int) -> UnitCorrection:
    rng = np.random.Generator(np.random.PCG64(seed))
    x, y, z = (ConverterModel(_normalised(rng, True), _normalised(rng, False)) for _ in range(3))
    return UnitCorrection("converter", (x, y, z))


def thermal(seed: int, form: Form = Form.BOTH) -> UnitCorrection:
    rng = np.random.Generator(np.random.PCG64(seed))

    def axis() -> AxisCorrection:
        a, b = rng.normal(size=(2, 4)).tolist()
        covariance = _covariance(rng, 8)
        return AxisCorrection(1.17, -0.09, tuple(a), tuple(b), 20.1, 19.9, form, (1e-4, -1e-5), covariance)

    first_stage = converter(seed + 1).converter if form is Form.SWITCHED else None
    return UnitCorrection("thermal", ThermalCorrection("accelerometer", (axis(), axis(), axis()), first_stage))


def thermometers(seed: int) -> UnitCorrection:
    rng = np.random.Generator(np.random.PCG64(seed))
    sensors = tuple(SensorCorrection(f"temperature_{i}", *(0.01 * rng.normal(size=2)).tolist()) for i in range(3))
    return UnitCorrection("thermometers", ThermometerCorrection(sensors, 20.25, _covariance(rng, 6), (-39.5, 60.1)))


def gyros(seed: int) -> UnitCorrection:
    rng = np.random.Generator(np.random.PCG64(seed))
    curves = [GyroPolynomial(tuple(rng.normal(size=n).tolist()), _covariance(rng, n) if n else ()) for n in (2, 0, 1)]
    known = thermometers(seed + 1).thermometers
    return UnitCorrection("gyros", GyroThermalCorrection((curves[0], curves[1], curves[2]), 20.1, (-40.0, 60.0), known))


def converter_model(
    current_ma: float, plus_code: Array, minus_code: Array, sensor_c: Array, reference_c: float = 20.0
) -> ConverterModel:
    """Model of a channel from mean codes at ±current, one pair a soak, and what its sensor read there, all (n,)."""
    found = zero_and_scale(current_ma, plus_code, minus_code)
    return ConverterModel(
        fit_normalised(sensor_c, found.scale_code_per_ma, reference_c, 2, relative=True),
        fit_normalised(sensor_c, found.zero_code, reference_c, 2, relative=False),
    )
