"""Result of `multi_position_calibration_of_recordings`. Written by `generate_results.py`; do not edit."""

from typing import Literal

from bench_client.results.part import ResultHead
from bench_client.results.shared_by_two import MultiPositionCalibrationDocument


class MultiPositionCalibrationOfRecordingsResult(ResultHead):
    """A result: Calibration in any positions, of recordings."""

    kind: Literal["method"]
    name: Literal["multi_position_calibration_of_recordings"]
    document: MultiPositionCalibrationDocument
