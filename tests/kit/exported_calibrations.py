"""Calibrations of random units as an export gets them."""

import numpy as np

from bench_service.formats.calibration_exports.subject import CalibrationSubject, TriadExport
from procedures.core.imu_model import TriadCalibration, triad_calibration
from procedures.core.noise import NoiseCoefficients

UNITS = {"gyro": "rad/s", "accelerometer": "m/s^2"}
NOISE = {
    "gyro": tuple(NoiseCoefficients(1e-6, 2e-5 * (i + 1), 3e-6, 4e-8, 0.0) for i in range(3)),
    "accelerometer": tuple(NoiseCoefficients(1e-6, 3e-4 * (i + 1), 5e-5, 6e-7, 0.0) for i in range(3)),
}


def a_triad(name: str, seed: int, count: bool = False) -> TriadCalibration:
    """A unit with scale factors of ±2 % and cross terms of ±1 %, in SI or in counts."""
    rng = np.random.Generator(np.random.PCG64(seed))
    size = 2.0e5 if count else 1.0
    k = (np.diag(1.0 + rng.uniform(-0.02, 0.02, 3)) + rng.uniform(-0.01, 0.01, (3, 3))) * size
    b = rng.uniform(-0.1, 0.1, 3) * size
    root = rng.normal(size=(12, 12)) * 1e-6 * size
    coefficients = np.column_stack([b, k]).ravel()
    return triad_calibration(name, "count" if count else UNITS[name], UNITS[name], coefficients, root @ root.T)


def an_export(value: TriadCalibration, **changes: object) -> TriadExport:
    facts = {
        "id": f"c-{value.triad}",
        "value": value,
        "method": "calibration_12_orientations",
        "origin": "",
        "verdict": "pass",
        "made_at": "2026-01-02T03:04:05+00:00",
        "simulated": False,
        "current": True,
        "approval": "open",
        "unusable": "",
        "valid_from": None,
        "valid_until": "2027-01-02T00:00:00+00:00",
        "temperature_c": (20.0, 23.0),
        "lineage": {"result": "r-1", "recordings": [{"id": "x", "content_hash": "f00d"}]},
    }
    return TriadExport(**{**facts, **changes})  # pyright: ignore[reportArgumentType]


def a_subject(seed: int = 1, count: bool = False, noise: bool = True) -> CalibrationSubject:
    triads = tuple(an_export(a_triad(name, seed + i, count)) for i, name in enumerate(UNITS))
    known = NOISE if noise else {}
    return CalibrationSubject(
        "U-1", 400.0, triads, "c-gyro", "2026-02-01T00:00:00+00:00", known, dict.fromkeys(known, "data")
    )
