#!/usr/bin/env bash
# Drivers for one and the same unit turn the same counts of its gyro into rates 0.1 % apart.
#
# Guess: sixteen bits over +-2000 deg/s are 2000/32768 deg/s a count for everybody; one g is 9.80665 m/s^2.
# Version: mpu6050-raspberrypi 1.2, mpu9250-jmdev 1.0.12, imusensor 1.0.1 (easydict 1.13, numpy 1.26.4, Python 3.11).
# All three read units with the same registers for gyro and accelerometer; a few lines below answer with constant
# counts, 16384 of the gyro (half of its range) and 2048 of the accelerometer (one g at 16 g).
# Behaviour: one divides by 16.4, the sensitivity that the data sheet prints rounded; one by 32768/2000 = 16.384; one by
# 32767.5/2000, and 32767.5 for the accelerometer too, with another g. Turns of 360 degrees on a rate table differ by
# 0.36 degrees between the first two. A scale factor calibrated through one driver is wrong by 976 ppm in the other.
# Output seen (deg/s; m/s^2; ppm of what the range says):
#   mpu6050-raspberrypi 1.2   999.0244 ( -976 ppm)    9.80665 (  +0 ppm)
#   mpu9250-jmdev 1.0.12     1000.0000 (   +0 ppm)    1.00000 g
#   imusensor 1.0.1          1000.0153 (  +15 ppm)    9.80715 ( +51 ppm)
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/venv"
"$folder/venv/bin/pip" install --quiet --disable-pip-version-check numpy==1.26.4 easydict==1.13
"$folder/venv/bin/pip" install --quiet --disable-pip-version-check --no-deps \
    mpu6050-raspberrypi==1.2 mpu9250-jmdev==1.0.12 imusensor==1.0.1
"$folder/venv/bin/python" - <<'PY'
import contextlib
import io
import struct
import sys
import time
import types

time.sleep = lambda seconds: None  # nothing has to settle
ACCELEROMETER, GYRO = 2048, 16384


class SMBus:
    """Registers of a unit: configuration is read back; from 0x3B on three accelerometers, temperature, three gyros."""

    def __init__(self, number=1):
        self.kept = {0x75: 0x71}
        words = [ACCELEROMETER] * 3 + [0] + [GYRO] * 3
        self.output = dict(enumerate(struct.pack(">7h", *words), start=0x3B))

    def write_byte_data(self, address, register, value):
        self.kept[register] = value

    def read_byte_data(self, address, register):
        return self.output.get(register, self.kept.get(register, 0))

    def read_i2c_block_data(self, address, register, count):
        return [self.read_byte_data(address, register + k) if 0x3B <= register < 0x49 else self.kept.get(register, 0)
                for k in range(count)]


fake = types.SimpleNamespace(SMBus=SMBus)
sys.modules["smbus"] = sys.modules["smbus2"] = fake
from imusensor.MPU9250 import MPU9250
from mpu6050 import mpu6050
from mpu9250_jmdev.mpu_9250 import MPU9250 as Other
from mpu9250_jmdev.registers import AFS_16G, GFS_2000

rates, forces = [], []
first = mpu6050(0x68)
first.set_gyro_range(first.GYRO_RANGE_2000DEG)
first.set_accel_range(first.ACCEL_RANGE_16G)
rates.append(first.get_gyro_data()["x"])
forces.append(first.get_accel_data()["x"])
second = Other(gfs=GFS_2000, afs=AFS_16G)
second.gbias = second.abias = [0, 0, 0]
second.configureMPU6500(GFS_2000, AFS_16G)
rates.append(second.readGyroscopeMaster()[0])
forces.append(second.readAccelerometerMaster()[0])
third = MPU9250.MPU9250(SMBus(), 0x68)
with contextlib.redirect_stdout(io.StringIO()):
    third.setGyroRange("GyroRangeSelect2000DPS")
    third.setAccelRange("AccelRangeSelect16G")
third.MagScale = 1.0
third.readSensor()
rates.append(third.GyroVals[0] * 180 / 3.141592653589793)
forces.append(third.AccelVals[0])
names = ("mpu6050-raspberrypi 1.2", "mpu9250-jmdev 1.0.12", "imusensor 1.0.1")
for name, rate, force in zip(names, rates, forces):
    ppm = 1e6 * (rate / 1000 - 1)
    shown = f"{force:.5f} g" if force < 2 else f"{force:.5f} ({1e6 * (force / 9.80665 - 1):+4.0f} ppm)"
    print(f"{name:24} {rate:9.4f} ({ppm:+5.0f} ppm)    {shown}")
same = [round(1e6 * (rate / 1000 - 1)) for rate in rates] == [-976, 0, 15]
sys.exit(0 if same else "the behaviour has changed")
PY
