"""Effects of temperature on the outputs, by hand; and that the defaults are of the size that the thesis prints."""

import numpy as np
import pytest

from simulators.chamber.behaviour import MA_PER_NOMINAL, accelerometers, converter_codes, gyros, response
from simulators.truth import TruthError
from simulators.truth.thermal import (
    AccelerometerThermalTruth,
    ConverterTruth,
    GyroThermalTruth,
    UnitThermalTruth,
)

AT_REFERENCE = np.full((1, 8), 20.0)


def nodes(case: float, converter: float, block: float = 20.0, gyros_c: tuple[float, ...] = (20.0, 20.0, 20.0)):
    return np.array([[0.0, 0.0, case, converter, block, *gyros_c]])


def test_at_the_reference_temperature_changes_nothing() -> None:
    found = response(UnitThermalTruth(gyro=GyroThermalTruth((1.0, 1.0, 1.0))), AT_REFERENCE)
    bias, through = np.array([0.1, 0.2, 0.3]), np.array([0.0, 8.0, 0.1])
    np.testing.assert_array_equal(found.accelerometer_output(bias, through)[0], bias + through)
    np.testing.assert_array_equal(found.gyro_added_rad_s, 0.0)


def test_static_and_dynamic_terms_by_hand() -> None:
    truth = AccelerometerThermalTruth((1e-3, 1e-4), (2e-3, 2e-4), (0.1, 0.01), (0.2, 0.02))
    gain, added = accelerometers([truth] * 3, nodes(30.0, 15.0))
    # case +10, converter −5: A = 0.01 + 0.01 − 0.01 + 0.005 = 0.015; B = 1 + 1 − 1 + 0.5 = 1.5
    np.testing.assert_allclose(gain, 1.0 / 1.015, rtol=1e-14)
    np.testing.assert_allclose(added, -1.5, rtol=1e-14)


def test_static_terms_may_act_at_the_block_inside() -> None:
    truth = AccelerometerThermalTruth(bias_static=(1.0, 0.0), block_share=0.25)
    _, added = accelerometers([truth] * 3, nodes(30.0, 20.0, block=50.0))
    np.testing.assert_allclose(added, -(0.75 * 10.0 + 0.25 * 30.0), rtol=1e-14)


def test_the_converter_by_hand_and_in_the_unit_alike() -> None:
    truth = ConverterTruth(2000.0, 12.0, (1e-3, 1e-5), (0.5, 0.01))
    # +10 °C: 2000·(1 + 0.01 + 0.001)·I + 12 + 5 + 1
    np.testing.assert_allclose(converter_codes(truth, np.array([3.0]), np.array([30.0])), 2022.0 * 3.0 + 18.0)
    still = AccelerometerThermalTruth()
    unit = UnitThermalTruth(accelerometers=(still, still, still), converter=(truth, truth, truth))
    output = response(unit, nodes(20.0, 30.0)).accelerometer_output(np.zeros(3), np.array([9.0, 0.0, 0.0]))
    codes = truth.codes_a_ma * MA_PER_NOMINAL * output + truth.zero_code
    np.testing.assert_allclose(codes[0, 0], 2022.0 * MA_PER_NOMINAL * 9.0 + 18.0, rtol=1e-14)
    np.testing.assert_allclose(codes[0, 1], 18.0, rtol=1e-12)


def test_a_healthy_perimeter_control_leaves_nothing_and_a_failing_one_its_residue() -> None:
    warm = nodes(30.0, 30.0, gyros_c=(30.0, 25.0, 10.0))
    np.testing.assert_array_equal(gyros(GyroThermalTruth(), warm), 0.0)
    np.testing.assert_allclose(gyros(GyroThermalTruth((1e-9, 2e-9, 0.0)), warm), [[1e-8, 1e-8, 0.0]])


def test_the_default_bias_is_table_4_5_s_before() -> None:
    for temperature, column in ((-20.0, (0.0975, 0.0968, 0.0715)), (60.0, (0.1241, 0.1830, 0.1212))):
        _, added = accelerometers(UnitThermalTruth().accelerometers, np.full((1, 8), temperature))
        np.testing.assert_allclose(3.0 * np.abs(added[0]), column, rtol=1e-9)


def test_terms_that_are_no_numbers_are_refused() -> None:
    with pytest.raises(TruthError, match="bias_static"):
        AccelerometerThermalTruth(bias_static=(float("nan"), 0.0))
    with pytest.raises(TruthError, match="block_share"):
        AccelerometerThermalTruth(block_share=1.1)
