#!/usr/bin/env bash
# Attitude filters erase the turn of a slow rate table.
#
# Guess: a unit that turns about the vertical at 1.8 deg/s for a minute has turned by 108 degrees
# in any attitude filter. Rest detection asks whether the rate is small, and 1.8 deg/s is
# hundreds of times the Earth's rate.
# Versions: vqf 2.1.2, imufusion 1.3.3 (numpy 2.4.6, Python 3.11).
# Behaviour: both call a unit at rest that turns steadily. VQF compares the rate with its own
# low-pass value (limit 2 deg/s on the change, and on the mean), then learns the mean as bias.
# The Bias class of imufusion does the same below 3 deg/s. The turn vanishes without a word;
# a faster turn is whole. For a rate table, switch restBiasEstEnabled off (VQF) or leave Bias out.
# Output seen:
#   table 1.8 deg/s for 60 s, true turn 108 deg: VQF 3.1 deg (bias learnt 1.80 deg/s), imufusion 19.7 deg
#   table 5.0 deg/s for 60 s, true turn 300 deg: VQF 300.0 deg (bias learnt 0.00 deg/s), imufusion 300.0 deg
#   VQF without rest bias estimation at 1.8 deg/s: 108.0 deg
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/venv"
"$folder/venv/bin/pip" install --quiet --disable-pip-version-check \
    numpy==2.4.6 vqf==2.1.2 imufusion==1.3.3
"$folder/venv/bin/python" - <<'PY'
import sys

import imufusion
import numpy as np
import vqf

FREQUENCY, DURATION = 100, 60


def turn_in_vqf(rate, **settings):
    samples = FREQUENCY * DURATION
    gyro = np.zeros((samples, 3))
    gyro[:, 2] = np.radians(rate)
    force = np.tile([0.0, 0.0, 9.81], (samples, 1))
    result = vqf.VQF(1 / FREQUENCY, **settings).updateBatch(gyro, force)
    q = result["quat6D"][-1]
    return np.degrees(2 * np.arctan2(q[3], q[0])) % 360, np.degrees(result["bias"][-1][2])


def turn_in_imufusion(rate):
    bias = imufusion.Bias()  # default settings, 100 Hz
    sample = np.array([0.0, 0.0, rate], dtype=np.float32)
    return sum(float(bias.update(sample)[2]) for _ in range(FREQUENCY * DURATION)) / FREQUENCY


seen = {}
for rate in (1.8, 5.0):
    angle, bias = turn_in_vqf(rate)
    other = turn_in_imufusion(rate)
    seen[rate] = angle, bias, other
    print(f"table {rate} deg/s for {DURATION} s, true turn {rate * DURATION:.0f} deg: "
          f"VQF {angle:.1f} deg (bias learnt {bias:.2f} deg/s), imufusion {other:.1f} deg")
plain, _ = turn_in_vqf(1.8, restBiasEstEnabled=False)
print(f"VQF without rest bias estimation at 1.8 deg/s: {plain:.1f} deg")
slow, fast = seen[1.8], seen[5.0]
same = (slow[0] < 5 and slow[1] > 1.79 and slow[2] < 25
        and abs(fast[0] - 300) < 0.1 and abs(fast[2] - 300) < 0.1 and abs(plain - 108) < 0.1)
sys.exit(0 if same else "the behaviour has changed")
PY
