"""Our own JSON of a calibration: forward and inverse model with their covariance, and where they hold."""

import json
from typing import Any

from bench_service.formats.calibration_exports.algebra import inverse_model
from bench_service.formats.calibration_exports.subject import CalibrationSubject, TriadExport
from procedures.core.imu_model import COEFFICIENT_NAMES, coefficient_unit

FORMAT, VERSION = "bench-calibration", 1
INVERSE_NAMES = tuple(name.replace("b_", "c_").replace("K", "A") for name in COEFFICIENT_NAMES)
FORMULA = {
    "forward": "U = b + K·v + n",
    "inverse": "v = A·U + c of one sample, U·Aᵀ + c of samples in rows, with A = K⁻¹ and c = −K⁻¹·b; "
    "the same as v = A·(U − b)",
    "U": "nominal output of the channels x, y, z: scale·(raw − offset), an increment divided by the sample period",
    "v": "specific force or angular rate in the orthogonal axes of the frame",
    "K": "row: output channel, column: input axis",
    "n": "noise, not corrected",
}
FRAME = (
    "orthogonal right-handed axes of the mounting in which the unit was calibrated; an accelerometer at rest with its "
    "axis up reads +g; a positive rotation is counter-clockwise seen from the tip of the axis"
)


def own_json(subject: CalibrationSubject) -> str:
    """Return the JSON document as text; its numbers are the stored ones to the last bit."""
    document: dict[str, Any] = {
        "format": FORMAT,
        "version": VERSION,
        "unit": subject.unit,
        "exported_at": subject.exported_at,
        "formula": FORMULA,
        "frame": FRAME,
        "mounting": _mounting(subject),
        "remarks": list(subject.remarks()),
        "triads": [_triad(t) for t in subject.triads],
        "noise": {name: _noise(subject, name) for name in subject.noise},
    }
    return json.dumps(document, indent=1, ensure_ascii=False, allow_nan=False) + "\n"


def _mounting(subject: CalibrationSubject) -> dict[str, Any] | None:
    """The mounting of all triads; None where there was none, or each had its own."""
    first = subject.triads[0].mounting
    return first if all(t.mounting == first for t in subject.triads) else None


def _triad(one: TriadExport) -> dict[str, Any]:
    value, inverse = one.value, inverse_model(one.value)
    return {
        "triad": one.triad,
        "calibration": one.id,
        "method": one.method,
        "model": value.model,
        "output_unit": value.output_unit,
        "input_unit": value.input_unit,
        "forward": {"b": list(value.bias), "K": [list(row) for row in value.matrix]},
        "inverse": {"A": inverse.matrix.tolist(), "c": inverse.offset.tolist()},
        "coefficients": [
            {
                "name": n,
                "value": x,
                "unit": coefficient_unit(n, value.output_unit, value.input_unit),
                "standard_uncertainty": u,
            }
            for n, x, u in zip(
                COEFFICIENT_NAMES, value.coefficients.tolist(), value.standard_uncertainties.tolist(), strict=True
            )
        ],
        "covariance": {"order": list(COEFFICIENT_NAMES), "matrix": [list(row) for row in value.covariance]},
        "inverse_covariance": {"order": list(INVERSE_NAMES), "matrix": inverse.covariance.tolist()},
        "mounting": one.mounting,
        "temperature_c": None if one.temperature_c is None else list(one.temperature_c),
        "validity": {
            "approval": one.approval,
            "valid_from": one.valid_from,
            "valid_until": one.valid_until,
            "unusable": one.unusable,
            "verdict": one.verdict,
        },
        "made_at": one.made_at,
        "simulated": one.simulated,
        "origin": one.origin,
        "lineage": one.lineage,
    }


def _noise(subject: CalibrationSubject, name: str) -> dict[str, Any]:
    unit = {"gyro": "rad/s", "accelerometer": "m/s^2"}[name]
    channels = subject.noise[name]
    return {
        "origin": subject.noise_origin.get(name, ""),
        "model": "σ²(τ) = 3Q²/τ² + N²/τ + (2 ln 2/π)B² + K²τ/3 + R²τ²/2",
        "channels": ["x", "y", "z"],
        "quantization": {"unit": f"({unit})·s", "values": [c.quantization for c in channels]},
        "random_walk": {"unit": f"({unit})·√s", "values": [c.random_walk for c in channels]},
        "bias_instability": {"unit": unit, "values": [c.bias_instability for c in channels]},
        "rate_random_walk": {"unit": f"({unit})/√s", "values": [c.rate_random_walk for c in channels]},
        "rate_ramp": {"unit": f"({unit})/s", "values": [c.rate_ramp for c in channels]},
        "process_noise_of_a_filter": {
            "rule": "continuous spectral density of an error-state filter: of the rate N², of the bias K²",
            "rate": [c.random_walk**2 for c in channels],
            "bias": [c.rate_random_walk**2 for c in channels],
        },
    }
