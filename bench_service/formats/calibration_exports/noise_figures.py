"""Noise of a unit as files for pyins and NaveGo."""

import json
from typing import Any

from bench_service.formats.calibration_exports.subject import CalibrationSubject, commented
from procedures.core.units import DEG, DEG_PER_SQRT_HOUR, HOUR, STANDARD_GRAVITY


def pyins(subject: CalibrationSubject) -> str:
    """JSON with arguments of pyins: ``InertialSensorError`` is the unit as it is, ``InertialSensorModel`` a filter's.

    The transform is K and the bias b as they are; noise = N and bias_walk = K of the noise, in SI; standard deviations
    are those of the coefficients, whose correlations are lost.
    """
    subject.require_noise("pyins")
    document: dict[str, Any] = {"comment": "; ".join([*subject.remarks(), "lost here: correlations, temperature"])}
    for name in ("gyro", "accelerometer"):
        one, channels = subject.required_si(name, "pyins").value, subject.noise[name]
        sd = one.standard_uncertainties.reshape(3, 4)
        noise = [c.random_walk for c in channels]
        walk = [c.rate_random_walk for c in channels]
        document[name] = {
            "InertialSensorError": {
                "transform": [list(row) for row in one.matrix],
                "bias": list(one.bias),
                "noise": noise,
                "bias_walk": walk,
            },
            "InertialSensorModel": {
                "bias_sd": sd[:, 0].tolist(),
                "noise": noise,
                "bias_walk": walk,
                "scale_misal_sd": sd[:, 1:].tolist(),
            },
        }
    return json.dumps(document, indent=1, ensure_ascii=False, allow_nan=False) + "\n"


def navego(subject: CalibrationSubject) -> str:
    """Return a script with the fields of NaveGo's IMU structure that it converts by ``imu_si_errors``; static biases
    are b. Raises `BadParameter`.
    """
    subject.require_noise("navego")
    force, rate = subject.required_si("accelerometer", "navego").value, subject.required_si("gyro", "navego").value
    f, w = subject.noise["accelerometer"], subject.noise["gyro"]
    rows = {
        "arw": ([c.random_walk / DEG_PER_SQRT_HOUR for c in w], "deg/root-hour"),
        "vrw": ([c.random_walk * HOUR**0.5 for c in f], "m/s/root-hour"),
        "arrw": ([c.rate_random_walk / DEG_PER_SQRT_HOUR for c in w], "deg/root-hour/s"),
        "vrrw": ([c.rate_random_walk * HOUR**0.5 for c in f], "m/s/root-hour/s"),
        "gb_sta": ([b / DEG for b in rate.bias], "deg/s"),
        "ab_sta": ([b / (STANDARD_GRAVITY * 1e-3) for b in force.bias], "mg, of 9.80665 m/s^2"),
        "gb_dyn": ([c.bias_instability / DEG for c in w], "deg/s"),
        "ab_dyn": ([c.bias_instability / (STANDARD_GRAVITY * 1e-3) for c in f], "mg, of 9.80665 m/s^2"),
    }
    lines = commented(
        subject,
        "%",
        "gb_dyn and ab_dyn are bias instabilities B; their correlation times gb_corr and ab_corr are not known: Inf",
        "lost in this file: scale factors and cross terms, covariance, temperature",
    )
    lines += [f"imu.{name} = [{' '.join(map(repr, values))}]; % {unit}" for name, (values, unit) in rows.items()]
    lines += [
        "imu.gb_corr = [Inf Inf Inf]; % s",
        "imu.ab_corr = [Inf Inf Inf]; % s",
        f"imu.freq = {subject.rate_hz!r}; % Hz",
    ]
    return "\n".join(lines) + "\n"
