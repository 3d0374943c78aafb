#!/usr/bin/env bash
# The Kalman filter of scikit-kinematics says that a tilted unit is level, and more than doubles a turn.
#
# Guess: imus.kalman(rate, acc, omega, mag) returns, as its docstring says, the orientation relative to
# the local magnetic field and gravity: 30 degrees for a unit that rests at 30 degrees.
# Version: scikit-kinematics 0.10.4 (numpy 2.4.6, scipy 1.17.1, Python 3.11).
# Behaviour: the last line of the function divides by the first quaternion, so the first attitude is the
# identity always, and a unit at rest is level however it lies. And each update adds the CHANGE of
# the measured quaternion to a state that the rate has turned already: a turn by 30 degrees and four
# seconds of rest end at 66.6 degrees, with perfect data. (The argument D is overwritten too.)
# Output seen:
#   at rest, rolled by 30 deg:       result  0.0 deg
#   turned by 30 deg, then at rest:  result 66.6 deg
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/venv"
"$folder/venv/bin/pip" install --quiet --disable-pip-version-check \
    numpy==2.4.6 scipy==1.17.1 scikit-kinematics==0.10.4
"$folder/venv/bin/python" - <<'PY'
import os
import sys
import warnings

warnings.simplefilter("ignore")
os.environ.update(MPLBACKEND="Agg", PYGAME_HIDE_SUPPORT_PROMPT="1", SDL_VIDEODRIVER="dummy")
import numpy as np
from scipy.spatial.transform import Rotation
from skinematics import imus

RATE, SAMPLES = 100, 500
GRAVITY, FIELD = [0.0, 0.0, 9.81], [1.0, 0.0, -1.0]


def result(angles, rates):
    attitude = Rotation.from_rotvec(np.outer(angles, [1.0, 0.0, 0.0]))
    gyro = np.outer(rates, [1.0, 0.0, 0.0])
    to_body = attitude.inv()
    q = imus.kalman(RATE, to_body.apply(GRAVITY), gyro, to_body.apply(FIELD))[-1]
    return np.degrees(Rotation.from_quat(np.roll(q, -1)).magnitude())


times = np.arange(SAMPLES) / RATE
rest = result(np.full(SAMPLES, np.radians(30)), np.zeros(SAMPLES))
turned = result(np.radians(30) * np.clip(times, 0, 1), np.where(times < 1, np.radians(30), 0.0))
print(f"at rest, rolled by 30 deg:       result {rest:4.1f} deg")
print(f"turned by 30 deg, then at rest:  result {turned:4.1f} deg")
sys.exit(0 if rest < 0.01 and 60 < turned < 70 else "the behaviour has changed")
PY
