"""Result of `multi_position_calibration`. Written by `generate_results.py`; do not edit."""

from typing import Literal

from bench_client.results.part import ResultHead
from bench_client.results.shared_by_two import MultiPositionCalibrationDocument


class MultiPositionCalibrationResult(ResultHead):
    """A result: Calibration in any positions."""

    kind: Literal["procedure"]
    name: Literal["multi_position_calibration"]
    document: MultiPositionCalibrationDocument
