"""YAML of Kalibr and OpenVINS: ``K = L·Q``, noise densities, and the rotation that belongs to them.

Both have the forward model with a lower triangular matrix of the accelerometers, in the frame of which the gyros'
matrix is L_g·C. So with K_a = L_a·Q_a their frame is i = Q_a·(ours), and K_g·Q_aᵀ = L_g·C. Bias is no field of either:
it is in the comments.
"""

import numpy as np

from bench_service.formats.calibration_exports.algebra import triangle_and_rotation
from bench_service.formats.calibration_exports.subject import CalibrationSubject, commented
from procedures.core.arrays import Array
from procedures.core.errors import BadParameter

FRAME = (
    "the IMU frame of this file is Q times the unit's frame of the calibration (R_imu_from_unit): a mounting rotation",
    "of the unit must be multiplied with it, or the unit is turned by its misalignment",
)
UNSEEN_S = 3600.0
"""Averaging time at which the value written for a rate random walk of zero has the Allan deviation of the white
noise [s]."""


def kalibr_noise(subject: CalibrationSubject) -> str:
    """Return the text of Kalibr's imu.yaml: noise of the noisiest channel, in densities. Raises `BadParameter` where a
    noise is unknown, or a random walk N zero.
    """
    subject.require_noise("kalibr-imu")
    lines = commented(subject, "#", *_noise_remarks(subject))
    lines += [*_noise(subject, "kalibr-imu"), "rostopic: /imu0", f"update_rate: {_number(subject.rate_hz)}"]
    return "\n".join(lines) + "\n"


def kalibr_intrinsics(subject: CalibrationSubject) -> str:
    """Return the text of Kalibr's result with intrinsics of the model "scale-misalignment". Raises `BadParameter`."""
    force, rate, turn, rotation = _split(subject, "kalibr")
    known = len(subject.noise) == 2
    lines = commented(subject, "#", *FRAME, *_lost(subject), *(_stand_ins(subject) if known else ()))
    lines += ["imu0:", *_identity("  T_i_b", 4)]
    if known:
        lines += [f"  {line}" for line in _noise(subject, "kalibr")]
    lines += ["  accelerometers:", *_matrix("    M", force)]
    lines += [
        "  gyroscopes:",
        *_matrix("    A", np.zeros((3, 3))),
        *_matrix("    C_gyro_i", turn),
        *_matrix("    M", rate),
    ]
    lines += ["  model: scale-misalignment", "  rostopic: /imu0", "  time_offset: 0.0"]
    lines += [f"  update_rate: {_number(subject.rate_hz)}", *_matrix("  R_imu_from_unit", rotation)]
    return "\n".join(lines) + "\n"


def openvins(subject: CalibrationSubject) -> str:
    """Return the text of OpenVINS' kalibr_imu_chain.yaml of the model "kalibr"; its reader keeps lower triangles only.
    Raises `BadParameter`.
    """
    subject.require_noise("openvins")
    force, rate, turn, rotation = _split(subject, "openvins")
    lines = ["%YAML:1.0", "---", *commented(subject, "#", *FRAME, *_noise_remarks(subject), *_lost(subject))]
    lines += ["imu0:", *_identity("  T_i_b", 4), *(f"  {line}" for line in _noise(subject, "openvins"))]
    lines += [
        "  model: kalibr",
        "  rostopic: /imu0",
        "  time_offset: 0.0",
        f"  update_rate: {_number(subject.rate_hz)}",
    ]
    lines += [*_matrix("  Tw", rate), *_matrix("  R_IMUtoGYRO", turn), *_matrix("  Ta", force)]
    lines += [
        *_identity("  R_IMUtoACC", 3),
        *_matrix("  Tg", np.zeros((3, 3))),
        *_matrix("  R_imu_from_unit", rotation),
    ]
    return "\n".join(lines) + "\n"


def _split(subject: CalibrationSubject, form: str) -> tuple[Array, Array, Array, Array]:
    """L_a, L_g, C and Q_a."""
    k_a = subject.required_si("accelerometer", form).value.matrix_array
    k_g = subject.required_si("gyro", form).value.matrix_array
    force, rotation = triangle_and_rotation(k_a)
    rate, turn = triangle_and_rotation(k_g @ rotation.T)
    return force, rate, turn, rotation


def _lost(subject: CalibrationSubject) -> list[str]:
    bias = [f"{t.triad} bias [{t.value.input_unit}], no field here: {list(t.value.bias)}" for t in subject.triads]
    return [*bias, "lost in this file: bias, covariance, temperature; g-sensitivity is not determined and zero"]


def _noise_remarks(subject: CalibrationSubject) -> list[str]:
    origin = [f"noise of the {name}s: {source}" for name, source in subject.noise_origin.items()]
    return [
        *origin,
        "densities of the noisiest channel; quantization, bias instability and ramp have no field here",
        *_stand_ins(subject),
    ]


def _densities(subject: CalibrationSubject, form: str) -> dict[str, float]:
    """Fields with densities N [rate/√Hz] and K [rate/s/√Hz]; the bias instability belongs in no field.

    Kalibr and OpenVINS take none that is not above zero. For a K of zero stands ``N·√3/t``, whose Allan deviation
    ``K·√(t/3)`` equals that of the white noise, ``N/√t``, at `UNSEEN_S`; comments say so. Raises `BadParameter` with
    the way out where N is zero.
    """
    found: dict[str, float] = {}
    for key, name in (("accelerometer", "accelerometer"), ("gyroscope", "gyro")):
        white, walk = _of_noisiest(subject, name)
        if not white > 0.0:
            allowed = (
                "only for a unit whose random walks N are above zero, because Kalibr and OpenVINS read no other: that "
                f"of the {name}s is 0; declare a bound with PUT /api/v1/units/{subject.unit}, or take format json, "
                "pyins or navego"
            )
            raise BadParameter("format", form, allowed)
        found[f"{key}_noise_density"] = white
        found[f"{key}_random_walk"] = walk if walk > 0.0 else white * float(np.sqrt(3.0)) / UNSEEN_S
    return found


def _stand_ins(subject: CalibrationSubject) -> list[str]:
    """Comments on the rate random walks that are not the unit's."""
    return [
        f"rate random walk of the {name}s: 0, declared so or not observed, which this reader refuses; instead the one "
        "whose Allan deviation equals that of the white noise after an hour"
        for name in ("accelerometer", "gyro")
        if not _of_noisiest(subject, name)[1] > 0.0
    ]


def _of_noisiest(subject: CalibrationSubject, name: str) -> tuple[float, float]:
    """N and K of the noisiest channel of a triad."""
    channels = subject.noise[name]
    return max(c.random_walk for c in channels), max(c.rate_random_walk for c in channels)


def _noise(subject: CalibrationSubject, form: str) -> list[str]:
    return [f"{key}: {_number(value)}" for key, value in _densities(subject, form).items()]


def _matrix(key: str, matrix: Array) -> list[str]:
    indent = " " * (len(key) - len(key.lstrip()))
    return [f"{key}:", *(f"{indent}- [{', '.join(map(_number, row))}]" for row in matrix.tolist())]


def _identity(key: str, size: int) -> list[str]:
    return _matrix(key, np.eye(size))


def _number(value: float) -> str:
    """A number that YAML 1.1 reads as one: "1e-05" without a point would be text."""
    text = repr(float(value))
    mantissa, e, exponent = text.partition("e")
    return text if not e or "." in mantissa else f"{mantissa}.0e{exponent}"
