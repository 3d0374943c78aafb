"""Samples of calibrations, and of the document of a result that gives one."""

from typing import Any

import numpy as np
from pydantic_core import to_jsonable_python

from procedures.core.imu_model import COEFFICIENT_NAMES, TriadCalibration, triad_calibration


def triad(name: str, seed: int = 1) -> TriadCalibration:
    """Coefficients with a full covariance, so that a lost correlation is seen."""
    rng = np.random.Generator(np.random.PCG64(seed))
    unit = {"gyro": "rad/s", "accelerometer": "m/s^2"}[name]
    root = rng.normal(size=(12, 12)) * 1e-6
    return triad_calibration(name, unit, unit, rng.normal(size=12), root @ root.T)


def document_of(calibration: TriadCalibration) -> dict[str, Any]:
    """A result's document as the twelve orientations write it."""
    numbers = zip(COEFFICIENT_NAMES, calibration.coefficients, calibration.standard_uncertainties, strict=True)
    rows = [
        {
            "name": f"{calibration.triad}.{name}",
            "unit": "1" if name.startswith("K") else "rad/s",
            "estimate": float(value),
            "standard_uncertainty": float(sd),
            "from_noise": 0.25,
        }
        for name, value, sd in numbers
    ]
    of_other = {"name": "gyro.asymmetry_x", "unit": "1", "estimate": 0.125, "standard_uncertainty": 0.5}
    return {"triads": [{"calibration": to_jsonable_python(calibration), "coefficients": rows}], "more": [of_other]}
