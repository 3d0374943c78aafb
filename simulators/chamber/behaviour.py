"""Response of the unit's outputs to the temperatures of its parts: pure functions of the nodes.

Everything is a departure from what the unit is with all nodes at `REFERENCE_C`. Written without sight of the inverse
that the analysis uses.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from procedures.core import units
from simulators.chamber.network import BLOCK, CASE, CONVERTER, GYRO
from simulators.truth import Array
from simulators.truth.thermal import (
    REFERENCE_C,
    AccelerometerThermalTruth,
    ConverterTruth,
    GyroThermalTruth,
    UnitThermalTruth,
)

CURRENT_MA_PER_G = 1.1
"""Accelerometer's current (thesis table 1.3, AKS-05N) [mA a standard g]."""
MA_PER_NOMINAL = CURRENT_MA_PER_G / units.STANDARD_GRAVITY
"""Nominal output [m/s²] to the converter's input [mA]."""


@dataclass(frozen=True)
class Response:
    """Response of the three accelerometer and three gyro channels to temperature, each (n, 3).

    Nominal accelerometer output of a bias b and a through-put a = (K·f)_i [m/s²]:
    ``U = converter_gain·(b + sensor_gain·a + sensor_added) + converter_added``; of a gyro ``U + gyro_added``.
    """

    sensor_gain: Array
    sensor_added_m_s2: Array
    converter_gain: Array
    converter_added_m_s2: Array
    gyro_added_rad_s: Array

    def accelerometer_output(self, bias: Array, through: Array) -> Array:
        """Outputs U (n, 3) of b (3,) and a, (3,) or (n, 3) [m/s²], in closed form: for tests of what judges a unit."""
        inner = bias + self.sensor_gain * through + self.sensor_added_m_s2
        return self.converter_gain * inner + self.converter_added_m_s2


def response(truth: UnitThermalTruth, temperatures_c: Array) -> Response:
    """Compute the response at node temperatures (n, 8) in the order of `NODES` [°C]."""
    gain, added = accelerometers(truth.accelerometers, temperatures_c)
    converter_gain, zero = converters(truth.converter, temperatures_c[:, CONVERTER])
    return Response(gain, added, converter_gain, zero, gyros(truth.gyro, temperatures_c))


def accelerometers(truths: Sequence[AccelerometerThermalTruth], temperatures_c: Array) -> tuple[Array, Array]:
    """Compute gain 1/(1 + A) and added −B [m/s²] of each channel, (n, 3) both."""
    departure = temperatures_c - REFERENCE_C
    case, block, board = (departure[:, [node]] for node in (CASE, BLOCK, CONVERTER))
    share = np.array([t.block_share for t in truths])
    structure = case + share * (block - case)
    torquer = _square([t.scale_static for t in truths], structure)
    torquer += _square([t.scale_dynamic for t in truths], board)
    rest = _square([t.bias_static for t in truths], structure) + _square([t.bias_dynamic for t in truths], board)
    return 1.0 / (1.0 + torquer), -rest


def converters(truths: Sequence[ConverterTruth], board_c: Array) -> tuple[Array, Array]:
    """Gain Fc and change of zero Fs as nominal output [m/s²] at board temperatures (n,), (n, 3) both."""
    departure = board_c[:, None] - REFERENCE_C
    codes_per_nominal = MA_PER_NOMINAL * np.array([t.codes_a_ma for t in truths])
    gain = 1.0 + _square([t.scale_drift for t in truths], departure)
    return gain, _square([t.zero_drift for t in truths], departure) / codes_per_nominal


def converter_codes(truth: ConverterTruth, current_ma: Array, board_c: Array) -> Array:
    """Return the converter's output codes (n,), not yet rounded to whole numbers, at currents [mA] and board
    temperatures [°C], both (n,).
    """
    departure = board_c - REFERENCE_C
    gain = truth.codes_a_ma * (1.0 + _square(truth.scale_drift, departure))
    return gain * current_ma + truth.zero_code + _square(truth.zero_drift, departure)


def gyros(truth: GyroThermalTruth, temperatures_c: Array) -> Array:
    """Residue that a failing perimeter control lets through, (n, 3) [rad/s]; zero for a healthy one."""
    return np.array(truth.fault_residue_rad_s_c) * (temperatures_c[:, GYRO] - REFERENCE_C)


def _square(pairs: Sequence[float] | Sequence[tuple[float, float]], departure: Array) -> Array:
    """``p₁·d + p₂·d²`` of one pair, or of one for each channel: (n, channels) of d (n, 1) or (n, channels)."""
    first, second = np.array(pairs).T
    return (first + second * departure) * departure
