"""Result of `ferraris_calibration`. Written by `generate_results.py`; do not edit."""

from typing import Literal

from bench_client.results.part import ResultHead
from bench_client.results.shared_by_two import FerrarisCalibrationDocument


class FerrarisCalibrationResult(ResultHead):
    """A result: Calibration on six faces, by rests and turns."""

    kind: Literal["procedure"]
    name: Literal["ferraris_calibration"]
    document: FerrarisCalibrationDocument
