#!/usr/bin/env bash
# imufusion shows a scale error of a perfect gyro that grows with the square of the rate.
#
# Guess: a constant rate is integrated exactly, so a perfect gyro on a rate table turns by rate times time
# at any rate within its range; sampling at 100 Hz loses nothing of a steady turn.
# Versions: imufusion 1.3.3, vqf 2.1.2 for comparison (numpy 2.4.6, Python 3.11).
# Behaviour: imufusion adds the half rotation vector to the quaternion and scales to length one, so a
# step of angle a turns by 2 atan(a/2): relative error a^2/12. At 100 Hz that is 25 ppm at
# 100 deg/s, 634 ppm at 500 and 5654 ppm at 1500 deg/s, the size of a real gyro's scale error. vqf is exact.
# Output seen (10 s at 100 Hz, unit level):
#    100 deg/s: imufusion   -25 ppm, vqf    0 ppm, -a^2/12   -25 ppm
#    500 deg/s: imufusion  -634 ppm, vqf    0 ppm, -a^2/12  -635 ppm
#   1500 deg/s: imufusion -5654 ppm, vqf    0 ppm, -a^2/12 -5712 ppm
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/venv"
"$folder/venv/bin/pip" install --quiet --disable-pip-version-check \
    numpy==2.4.6 imufusion==1.3.3 vqf==2.1.2
"$folder/venv/bin/python" - <<'PY'
import sys

import imufusion
import numpy as np
import vqf

FREQUENCY, SAMPLES = 100, 1000
UP = np.array([0.0, 0.0, 1.0], dtype=np.float32)


def heading(q):
    return 2 * np.arctan2(float(q[3]), float(q[0]))


def total(turns):
    # Radians of the whole turn from the heading after every sample.
    return np.unwrap(np.concatenate([[0.0], turns]))[-1]


def with_imufusion(rate):
    filter_ = imufusion.Ahrs()
    filter_.set_sample_period(1 / FREQUENCY)
    filter_.skip_startup()
    sample = np.array([0.0, 0.0, rate], dtype=np.float32)
    turns = []
    for _ in range(SAMPLES):
        filter_.update_no_magnetometer(sample, UP)
        turns.append(heading(filter_.get_quaternion()))
    return total(turns)


def with_vqf(rate):
    gyro = np.tile([0.0, 0.0, np.radians(rate)], (SAMPLES, 1))
    force = np.tile([0.0, 0.0, 9.81], (SAMPLES, 1))
    quaternions = vqf.VQF(1 / FREQUENCY).updateBatch(gyro, force)["quat6D"]
    return total([heading(q) for q in quaternions])


same = True
for rate in (100, 500, 1500):
    true = np.radians(rate) * SAMPLES / FREQUENCY
    one, other = (1e6 * (turn / true - 1) for turn in (with_imufusion(rate), with_vqf(rate)))
    expected = -1e6 * np.radians(rate / FREQUENCY) ** 2 / 12
    print(f"{rate:5} deg/s: imufusion {one:5.0f} ppm, vqf {round(other) + 0:4} ppm, -a^2/12 {expected:5.0f} ppm")
    same = same and abs(one / expected - 1) < 0.05 and abs(other) < 1
sys.exit(0 if same else "the behaviour has changed")
PY
