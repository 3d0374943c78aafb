"""MATLAB: the row form ``C = U*A + b`` of accelcal and magcal, and the error set of PSINS."""

import numpy as np

from bench_service.formats.calibration_exports.algebra import inverse_model, triangle_and_rotation
from bench_service.formats.calibration_exports.subject import CalibrationSubject, commented
from procedures.core.arrays import Array


def matlab_rows(subject: CalibrationSubject) -> str:
    """Return a script that sets ``A_gyro, b_gyro, A_accelerometer, b_accelerometer`` for samples in rows."""
    lines = commented(
        subject, "%", "samples U are rows, n-by-3: C = U*A + b; b is added (accelcal's and magcal's form)"
    )
    for one in subject.triads:
        inverse = inverse_model(one.value)
        lines.append(f"% {one.triad}: U in {one.value.output_unit}, C in {one.value.input_unit}")
        lines.append(f"A_{one.triad} = {_matrix(inverse.matrix.T)};")
        lines.append(f"b_{one.triad} = {_matrix(inverse.offset[None, :])};")
    return "\n".join([*lines, "% lost in this file: covariance, temperature, lineage"]) + "\n"


def psins(subject: CalibrationSubject) -> str:
    """Return a script with a call of PSINS' ``imuerrset`` for simulations with this unit's errors, U = (I + dK)·v + b.
    Raises `BadParameter`.

    Numbers are SI divided by the toolbox's own constants, so its size of a µg is the one that counts.
    """
    force, rate = subject.required_si("accelerometer", "psins"), subject.required_si("gyro", "psins")
    lower, rotation = triangle_and_rotation(force.value.matrix_array)
    d_a, d_g = lower - np.eye(3), rate.value.matrix_array @ rotation.T - np.eye(3)
    lines = commented(
        subject,
        "%",
        "PSINS has a lower triangular matrix of the accelerometers: its frame is Q times the unit's, K_a = L*Q",
        "imuerrset draws no random errors for arguments that are vectors; noise is zero where the unit's is not known",
    )
    white = {name: [c.random_walk for c in channels] for name, channels in subject.noise.items()}
    lines += [
        "glvs;",
        f"Q = {_matrix(rotation)};",
        f"eb = {_column(rate.value.bias)}/glv.dph;",
        f"db = {_column(force.value.bias)}/glv.ug;",
        f"web = {_column(white.get('gyro', (0.0, 0.0, 0.0)))}/glv.dpsh;",
        f"wdb = {_column(white.get('accelerometer', (0.0, 0.0, 0.0)))}/glv.ugpsHz;",
        f"dKGii = {_column(np.diagonal(d_g))}/glv.ppm;",
        f"dKAii = {_column(np.diagonal(d_a))}/glv.ppm;",
        f"dKGij = {_column([d_g[i, j] for i, j in ((1, 0), (2, 0), (2, 1), (0, 1), (0, 2), (1, 2))])}/glv.sec;",
        f"dKAij = {_column([d_a[i, j] for i, j in ((1, 0), (2, 0), (2, 1))])}/glv.sec;",
        "imuerr = imuerrset(eb, db, web, wdb, 0, 0, 0, 0, dKGii, dKAii, dKGij, dKAij);",
        "% lost in this file: covariance, temperature; the toolbox takes increments, not rates",
    ]
    return "\n".join(lines) + "\n"


def _matrix(matrix: Array) -> str:
    return "[" + "; ".join(" ".join(map(repr, row)) for row in matrix.tolist()) + "]"


def _column(values: object) -> str:
    return "[" + "; ".join(map(repr, np.asarray(values, dtype=np.float64).tolist())) + "]"
