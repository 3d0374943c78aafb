"""Result of `ferraris_calibration_of_recordings`. Written by `generate_results.py`; do not edit."""

from typing import Literal

from bench_client.results.part import ResultHead
from bench_client.results.shared_by_two import FerrarisCalibrationDocument


class FerrarisCalibrationOfRecordingsResult(ResultHead):
    """A result: Calibration on six faces from recordings."""

    kind: Literal["method"]
    name: Literal["ferraris_calibration_of_recordings"]
    document: FerrarisCalibrationDocument
