#!/usr/bin/env bash
# The bias that smsfusion calibrates has the opposite sign of the bias that its navigator takes.
#
# Guess: a gyro that reads 0.01 rad/s too much has bias +0.01; calibrate() returns that (with
# bias_alt=True in units of the raw readings), and StrapdownINS of the same package takes it.
# Version: smsfusion 1.9.1 (numpy 2.4.6, scipy 1.17.1, Python 3.11).
# Behaviour: calibrate() returns what has to be ADDED, reference = W (reading + bias), so -0.01;
# StrapdownINS subtracts the bias of its state. Handing the one to the other doubles the error instead of
# removing it. With the plain call the bias is in units of the reference, behind W, as well.
# Output seen (unit at rest for 10 s, gyro reads 0.01 rad/s about z):
#   calibrate() returns bias z = -0.010 rad/s
#   heading without a bias:        0.100 rad
#   heading with this bias:        0.200 rad
#   heading with its negative:     0.000 rad
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/venv"
"$folder/venv/bin/pip" install --quiet --disable-pip-version-check \
    numpy==2.4.6 scipy==1.17.1 smsfusion==1.9.1
"$folder/venv/bin/python" - <<'PY'
import sys

import numpy as np
import smsfusion
from smsfusion.calibrate import calibrate

FREQUENCY, DURATION, TRUE_BIAS = 100, 10, np.array([0.0, 0.0, 0.01])
reference = np.vstack([np.eye(3), -np.eye(3)])  # table rates about each axis, both ways
_, bias = calibrate(reference, reference + TRUE_BIAS, bias_alt=True)
print(f"calibrate() returns bias z = {bias[2]:.3f} rad/s")


def heading(gyro_bias):
    # position, velocity, attitude (scalar first), accelerometer bias, gyro bias
    start = np.concatenate([np.zeros(6), [1, 0, 0, 0], np.zeros(3), gyro_bias])
    navigator = smsfusion.StrapdownINS(FREQUENCY, start)
    for _ in range(FREQUENCY * DURATION):
        navigator.update([0.0, 0.0, -9.80665], TRUE_BIAS)
    return float(navigator.euler()[2])


seen = [heading(np.zeros(3)), heading(bias), heading(-bias)]
for text, value in zip(("without a bias:    ", "with this bias:    ", "with its negative: "), seen):
    print(f"heading {text} {round(value, 3) + 0.0:9.3f} rad")
same = abs(bias[2] + 0.01) < 1e-9 and np.allclose(seen, [0.1, 0.2, 0.0], atol=1e-3)
sys.exit(0 if same else "the behaviour has changed")
PY
