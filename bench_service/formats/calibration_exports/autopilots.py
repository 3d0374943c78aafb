"""Parameters of ArduPilot and PX4: offsets and scales of each axis, with what they cannot hold said in the file.

Both apply ``(raw − offset)·scale`` to each axis; so offset = b and scale = 1/K_ii. The cross terms are lost, which
leaves an error of Σ|K_ij|·|v_j|. PX4 has no scale of gyros either, nor has ArduPilot.
"""

import numpy as np

from bench_service.formats.calibration_exports.subject import CalibrationSubject, TriadExport, commented
from procedures.core.errors import BadParameter
from procedures.core.units import DEG, STANDARD_GRAVITY

RATE = 100.0 * DEG
"""Angular rate for which a loss is stated [rad/s]: 100 deg/s."""
SCALES = (0.8, 1.2)
"""Range of a scale that the autopilots take; a scale beyond it is no misalignment but another unit or axis."""


def ardupilot(subject: CalibrationSubject) -> str:
    """Return the text of ArduPilot's parameter file for its first IMU: ``NAME,VALUE`` lines. Raises `BadParameter`
    where it cannot hold the calibration.
    """
    values = _offsets(subject, "ardupilot", "INS_ACCOFFS_{axis}", "INS_ACCSCAL_{axis}", "INS_GYROFFS_{axis}")
    remarks = [
        *_losses(subject),
        "these are the parameters of the first IMU: for the second write INS_ACC2OFFS_ and so on",
        "INS_GYR_CAL 0 keeps these gyro offsets: by default ArduPilot measures them anew at each start",
    ]
    return "\n".join([*commented(subject, "#", *remarks), *(f"{name},{value!r}" for name, value in values)]) + "\n"


def px4(subject: CalibrationSubject) -> str:
    """Return the text of PX4's parameter file for its first sensors, as QGroundControl loads it: tabs, type 9 is a
    32-bit float. Raises `BadParameter`.
    """
    values = _offsets(subject, "px4", "CAL_ACC0_{axis}OFF", "CAL_ACC0_{axis}SCALE", "CAL_GYRO0_{axis}OFF")
    remarks = [
        *_losses(subject),
        "CAL_ACC0_ID and CAL_GYRO0_ID are not in this file: they must be the ids of the sensors in the vehicle",
        "Vehicle-Id Component-Id Name Value Type",
    ]
    lines = [f"1\t1\t{name}\t{value!r}\t9" for name, value in values]
    return "\n".join([*commented(subject, "#", *remarks), *lines]) + "\n"


def _offsets(subject: CalibrationSubject, form: str, offset: str, scale: str, rate: str) -> list[tuple[str, float]]:
    force, turn = subject.required_si("accelerometer", form).value, subject.required_si("gyro", form).value
    found: list[tuple[str, float]] = []
    scales = 1.0 / np.diagonal(force.matrix_array)
    for axis, b, s in zip("XYZ", force.bias, scales.tolist(), strict=True):
        if not SCALES[0] <= s <= SCALES[1]:
            allowed = (
                f"a form with a full matrix: {form} takes scales of {SCALES[0]} to {SCALES[1]}, {axis} has {s:.4g}"
            )
            raise BadParameter("format", form, allowed)
        found += [(offset.format(axis=axis), b), (scale.format(axis=axis), s)]
    return [*found, *((rate.format(axis=axis), b) for axis, b in zip("XYZ", turn.bias, strict=True))]


def _losses(subject: CalibrationSubject) -> list[str]:
    """Errors that remain with an input of one g, or 100 deg/s, along each other axis."""
    lines = ["axes are the unit's own, before any rotation of sensor or board"]
    for one in subject.triads:
        left = lost(one).tolist()
        size = "1 g" if one.triad == "accelerometer" else "100 deg/s"
        shown = ", ".join(f"{axis} {value:.3g}" for axis, value in zip("xyz", left, strict=True))
        what = "cross terms" if one.triad == "accelerometer" else "scale factors and cross terms"
        lines.append(f"lost: {what} of the {one.triad}s; at {size} on every axis up to {shown} {one.value.input_unit}")
    return [*lines, "lost: covariance, temperature"]


def lost(one: TriadExport) -> np.ndarray:
    """Return the largest error of what is not corrected, (3,): at one g, or 100 deg/s, along every axis, in the input's
    unit.
    """
    matrix = one.value.matrix_array
    if one.triad == "accelerometer":
        rest = np.abs(matrix - np.diag(np.diagonal(matrix))).sum(axis=1)
        return rest / np.abs(np.diagonal(matrix)) * STANDARD_GRAVITY
    return np.abs(matrix - np.eye(3)).sum(axis=1) * RATE
