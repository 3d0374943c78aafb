"""The forms in which a calibration goes out, with their writers, endings and media types."""

from collections.abc import Callable
from enum import StrEnum
from typing import NamedTuple

from bench_service.formats.calibration_exports.autopilots import ardupilot, px4
from bench_service.formats.calibration_exports.imucal import imucal
from bench_service.formats.calibration_exports.kalibr import kalibr_intrinsics, kalibr_noise, openvins
from bench_service.formats.calibration_exports.matlab import matlab_rows, psins
from bench_service.formats.calibration_exports.noise_figures import navego, pyins
from bench_service.formats.calibration_exports.own_json import own_json
from bench_service.formats.calibration_exports.source_code import c_source, python_source
from bench_service.formats.calibration_exports.subject import CalibrationSubject


class CalibrationForm(StrEnum):
    """Form of an exported calibration, by the software that reads it."""

    JSON = "json"
    C = "c"
    PYTHON = "python"
    KALIBR = "kalibr"
    KALIBR_IMU = "kalibr-imu"
    OPENVINS = "openvins"
    ARDUPILOT = "ardupilot"
    PX4 = "px4"
    IMUCAL = "imucal"
    MATLAB = "matlab"
    PSINS = "psins"
    PYINS = "pyins"
    NAVEGO = "navego"


class ExportedCalibration(NamedTuple):
    """An exported calibration: name of the file, media type, text."""

    name: str
    media_type: str
    text: str


class _Form(NamedTuple):
    writer: Callable[[CalibrationSubject], str]
    ending: str
    media_type: str
    alone: bool
    """Whether one triad suffices."""


TEXT = "text/plain; charset=utf-8"
YAML = "application/yaml"
JSON = "application/vnd.bench.calibration+json"
"""Media type of its own, because this is a file for another program and not an answer of the API."""
_FORMS = {
    CalibrationForm.JSON: _Form(own_json, "json", JSON, True),
    CalibrationForm.C: _Form(c_source, "h", TEXT, True),
    CalibrationForm.PYTHON: _Form(python_source, "py", TEXT, True),
    CalibrationForm.KALIBR: _Form(kalibr_intrinsics, "yaml", YAML, False),
    CalibrationForm.KALIBR_IMU: _Form(kalibr_noise, "yaml", YAML, True),
    CalibrationForm.OPENVINS: _Form(openvins, "yaml", YAML, False),
    CalibrationForm.ARDUPILOT: _Form(ardupilot, "param", TEXT, False),
    CalibrationForm.PX4: _Form(px4, "params", TEXT, False),
    CalibrationForm.IMUCAL: _Form(imucal, "json", JSON, False),
    CalibrationForm.MATLAB: _Form(matlab_rows, "m", TEXT, True),
    CalibrationForm.PSINS: _Form(psins, "m", TEXT, False),
    CalibrationForm.PYINS: _Form(pyins, "json", JSON, False),
    CalibrationForm.NAVEGO: _Form(navego, "m", TEXT, False),
}
MEDIA_TYPES = tuple(dict.fromkeys(form.media_type.split(";")[0] for form in _FORMS.values()))


def takes_one_triad(form: CalibrationForm) -> bool:
    """Return whether a form can hold one triad alone; the others need both."""
    return _FORMS[form].alone


def exported(subject: CalibrationSubject, form: CalibrationForm) -> ExportedCalibration:
    """Return a calibration as a file in a form. Raises `BadParameter` where the form cannot hold it, with the way
    out.
    """
    writer, ending, media_type, _ = _FORMS[form]
    return ExportedCalibration(f"{subject.unit}-{form.value}.{ending}", media_type, writer(subject))
