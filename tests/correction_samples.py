"""Correction sets with numbers in every place, drawn: what has to come back as it was."""

import numpy as np

from procedures.core.converter import ConverterModel, Normalised
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
