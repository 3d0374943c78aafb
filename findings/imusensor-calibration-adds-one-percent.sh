#!/usr/bin/env bash
# The six-position calibration of imusensor makes a perfect accelerometer read one percent too much.
#
# Guess: after caliberateAccelerometer() an accelerometer without bias and scale error reads as before, and one
# with a bias of 20 mg has lost it.
# Version: imusensor 1.0.1 (easydict 1.13, numpy 1.26.4, Python 3.11); the two bus calls that it makes are
# answered by thirty lines below that hold a constant specific force in the registers of the data sheet.
# Behaviour: each mean of a position is taken over 100 rows of which the first is never filled and stays zero,
# so every mean is 1 % small and the scale factor that is stored 1/0.99 too large. The bias of 20 mg is lost.
# Nothing is said; the six means are printed one by one and look plausible.
# Output seen (local gravity as the package has it, 9.807 m/s^2):
#   bias   0 mg: unit on its x axis reads 9.8071 before and 9.9061 m/s^2 after the calibration (+1.010 %)
#   bias  20 mg: unit on its x axis reads 10.0029 before and 9.9061 m/s^2 after the calibration (+1.010 %)
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/venv"
"$folder/venv/bin/pip" install --quiet --disable-pip-version-check numpy==1.26.4 easydict==1.13
"$folder/venv/bin/pip" install --quiet --disable-pip-version-check --no-deps imusensor==1.0.1
"$folder/venv/bin/python" - <<'PY'
import contextlib
import io
import struct
import sys
import time
import types

import numpy as np

time.sleep = lambda seconds: None  # the pauses between samples mean nothing to a constant
FULL_SCALE = {0x00: 2.0, 0x08: 4.0, 0x10: 8.0, 0x18: 16.0}
OUTPUT, CONFIG, IDENTITY = 0x3B, 0x1C, 0x75


class SMBus:
    """Registers of a sensor at rest: what is written is read back, what is measured is `force` in g plus a bias."""

    def __init__(self):
        self.kept, self.force, self.bias = {}, np.array([0.0, 0.0, 1.0]), np.zeros(3)

    def write_byte_data(self, address, register, value):
        self.kept[register] = value

    def read_i2c_block_data(self, address, register, count):
        if register == IDENTITY:
            return [0x71]
        if register == OUTPUT:
            counts = np.round((self.force + self.bias) / FULL_SCALE[self.kept[CONFIG]] * 32767.5)
            words = [int(count) for count in np.clip(counts, -32768, 32767)] + [0] * 4
            return list(struct.pack(">7h", *words)) + [0] * 7
        return [self.kept.get(register, 0)] * count


sys.modules["smbus"] = types.SimpleNamespace(SMBus=SMBus)
from imusensor.MPU9250 import MPU9250

SIX = [sign * axis for axis in np.eye(3) for sign in (1.0, -1.0)]


def reading(sensor):
    sensor.readSensor()
    return float(np.linalg.norm(sensor.AccelVals))


class Positions:
    """Turns the unit to the next of six positions where the calibration asks a person to."""

    def __init__(self, bus):
        self.bus, self.left = bus, iter(SIX)

    def write(self, text):
        if text.startswith("Put the IMU"):
            self.bus.force = next(self.left)

    def flush(self):
        pass


held = True
for bias in (0.0, 0.02):
    bus = SMBus()
    bus.bias[:] = bias, 0.0, 0.0
    sensor = MPU9250.MPU9250(bus, 0x68)
    with contextlib.redirect_stdout(io.StringIO()):
        sensor.begin()
        sensor.setAccelRange("AccelRangeSelect2G")
    bus.force = np.array([1.0, 0.0, 0.0])
    before = reading(sensor)
    with contextlib.redirect_stdout(Positions(bus)):
        sensor.caliberateAccelerometer()
    bus.force = np.array([1.0, 0.0, 0.0])
    after = reading(sensor)
    percent = 100 * (after / 9.807 - 1)
    reads = f"reads {before:.4f} before and {after:.4f} m/s^2 after the calibration ({percent:+.3f} %)"
    print(f"bias {1000 * bias:3.0f} mg: unit on its x axis {reads}")
    held &= 0.9 < percent < 1.1
sys.exit(0 if held else "the behaviour has changed")
PY
