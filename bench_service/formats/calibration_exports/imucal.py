"""Calibration JSON of the Python package imucal: ``f = R⁻¹·K⁻¹·(raw − b)`` for each triad, gyros in deg/s.

So K_a·R_a is our K, with K_a its diagonal. Format 2.0.0, calibration of the kind "Turntable".
"""

import json

import numpy as np

from bench_service.formats.calibration_exports.subject import CalibrationSubject, TriadExport
from procedures.core.arrays import Array
from procedures.core.units import DEG

FORMAT_VERSION = "2.0.0"


def imucal(subject: CalibrationSubject) -> str:
    """Return the JSON that ``imucal.management.load_calibration_info`` reads; it takes raw outputs in the unit named
    there. Raises `BadParameter`.
    """
    force, rate = subject.required("accelerometer", "imucal"), subject.required("gyro", "imucal")
    b_a, k_a, r_a, acc_unit = _parts(force, 1.0)
    b_g, k_g, r_g, gyr_unit = _parts(rate, DEG)
    document = {
        "cal_type": "Turntable",
        "acc_unit": "m/s^2",
        "gyr_unit": "deg/s",
        "from_acc_unit": acc_unit,
        "from_gyr_unit": gyr_unit,
        "comment": "; ".join([*subject.remarks(), "lost here: covariance, temperature; g-sensitivity not determined"]),
        "K_a": k_a,
        "R_a": r_a,
        "b_a": b_a,
        "K_g": k_g,
        "R_g": r_g,
        "b_g": b_g,
        "K_ga": np.zeros((3, 3)).tolist(),
        "_format_version": FORMAT_VERSION,
    }
    return json.dumps(document, indent=1, ensure_ascii=False, allow_nan=False) + "\n"


def _parts(one: TriadExport, degree: float) -> tuple[list[float], list[list[float]], list[list[float]], str]:
    """b, diagonal and rest, and the unit of the raw outputs; `degree`: size of the consumer's input unit in SI."""
    value = one.value
    matrix: Array = value.matrix_array
    bias = value.bias_array
    if value.output_unit == "count":  # counts a deg/s
        matrix, unit = matrix * degree, "a.u."
    else:  # outputs in the consumer's unit
        bias, unit = bias / degree, "deg/s" if one.triad == "gyro" else "m/s^2"
    diagonal = np.diagonal(matrix)
    return bias.tolist(), np.diag(diagonal).tolist(), (matrix / diagonal[:, None]).tolist(), unit
