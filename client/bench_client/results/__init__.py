"""Results as objects, a class for each procedure or method. By `generate_results.py`; do not edit."""

from typing import Any

from bench_client.results.allan_deviation import AllanDeviationResult
from bench_client.results.calibration_12_orientations import Calibration12OrientationsResult
from bench_client.results.converter_bench import ConverterBenchResult
from bench_client.results.dynamic_response import DynamicResponseResult
from bench_client.results.entered_thermal_correction import EnteredThermalCorrectionResult
from bench_client.results.error_growth import ErrorGrowthResult
from bench_client.results.ferraris_calibration import FerrarisCalibrationResult
from bench_client.results.ferraris_calibration_of_recordings import FerrarisCalibrationOfRecordingsResult
from bench_client.results.field_calibration import FieldCalibrationResult
from bench_client.results.free_inertial import FreeInertialResult
from bench_client.results.gyro_half_turns import GyroHalfTurnsResult
from bench_client.results.initial_alignment import InitialAlignmentResult
from bench_client.results.initial_alignment_of_recording import InitialAlignmentOfRecordingResult
from bench_client.results.kalman_calibration import KalmanCalibrationResult
from bench_client.results.mounting_repeatability import MountingRepeatabilityResult
from bench_client.results.multi_position_calibration import MultiPositionCalibrationResult
from bench_client.results.multi_position_calibration_of_recordings import MultiPositionCalibrationOfRecordingsResult
from bench_client.results.no_operation import NoOperationResult
from bench_client.results.noise_analysis import NoiseAnalysisResult
from bench_client.results.part import OtherResult, ResultHead
from bench_client.results.plan_orientations import PlanOrientationsResult
from bench_client.results.polarity_check import PolarityCheckResult
from bench_client.results.run_to_run import RunToRunResult
from bench_client.results.scalar_calibration import ScalarCalibrationResult
from bench_client.results.scale_factor_whole_turns import ScaleFactorWholeTurnsResult
from bench_client.results.static_run import StaticRunResult
from bench_client.results.table_program import TableProgramResult
from bench_client.results.temperature_dependence import TemperatureDependenceResult
from bench_client.results.thermal_correction_of_recordings import ThermalCorrectionOfRecordingsResult
from bench_client.results.thermal_cycle import ThermalCycleResult
from bench_client.results.thermometer_calibration import ThermometerCalibrationResult
from bench_client.results.verification_9_orientations import Verification9OrientationsResult

Result = (
    Calibration12OrientationsResult
    | ConverterBenchResult
    | DynamicResponseResult
    | FerrarisCalibrationResult
    | InitialAlignmentResult
    | MultiPositionCalibrationResult
    | NoOperationResult
    | PolarityCheckResult
    | ScaleFactorWholeTurnsResult
    | StaticRunResult
    | TableProgramResult
    | ThermalCycleResult
    | ThermometerCalibrationResult
    | Verification9OrientationsResult
    | AllanDeviationResult
    | EnteredThermalCorrectionResult
    | ErrorGrowthResult
    | FerrarisCalibrationOfRecordingsResult
    | FieldCalibrationResult
    | FreeInertialResult
    | GyroHalfTurnsResult
    | InitialAlignmentOfRecordingResult
    | KalmanCalibrationResult
    | MountingRepeatabilityResult
    | MultiPositionCalibrationOfRecordingsResult
    | NoiseAnalysisResult
    | PlanOrientationsResult
    | RunToRunResult
    | ScalarCalibrationResult
    | TemperatureDependenceResult
    | ThermalCorrectionOfRecordingsResult
    | OtherResult
)
"""A result; `isinstance` or `match` says which, and then its `document` has fields of its own."""
CLASSES: dict[str, type[ResultHead]] = {
    "calibration_12_orientations": Calibration12OrientationsResult,
    "converter_bench": ConverterBenchResult,
    "dynamic_response": DynamicResponseResult,
    "ferraris_calibration": FerrarisCalibrationResult,
    "initial_alignment": InitialAlignmentResult,
    "multi_position_calibration": MultiPositionCalibrationResult,
    "no_operation": NoOperationResult,
    "polarity_check": PolarityCheckResult,
    "scale_factor_whole_turns": ScaleFactorWholeTurnsResult,
    "static_run": StaticRunResult,
    "table_program": TableProgramResult,
    "thermal_cycle": ThermalCycleResult,
    "thermometer_calibration": ThermometerCalibrationResult,
    "verification_9_orientations": Verification9OrientationsResult,
    "allan_deviation": AllanDeviationResult,
    "entered_thermal_correction": EnteredThermalCorrectionResult,
    "error_growth": ErrorGrowthResult,
    "ferraris_calibration_of_recordings": FerrarisCalibrationOfRecordingsResult,
    "field_calibration": FieldCalibrationResult,
    "free_inertial": FreeInertialResult,
    "gyro_half_turns": GyroHalfTurnsResult,
    "initial_alignment_of_recording": InitialAlignmentOfRecordingResult,
    "kalman_calibration": KalmanCalibrationResult,
    "mounting_repeatability": MountingRepeatabilityResult,
    "multi_position_calibration_of_recordings": MultiPositionCalibrationOfRecordingsResult,
    "noise_analysis": NoiseAnalysisResult,
    "plan_orientations": PlanOrientationsResult,
    "run_to_run": RunToRunResult,
    "scalar_calibration": ScalarCalibrationResult,
    "temperature_dependence": TemperatureDependenceResult,
    "thermal_correction_of_recordings": ThermalCorrectionOfRecordingsResult,
}


def result_of_document(document: dict[str, Any]) -> Result:
    """Make an object of a result's JSON document, by its name; of one that is not known here, an `OtherResult`."""
    return CLASSES.get(str(document.get("name")), OtherResult).model_validate(document)  # pyright: ignore
