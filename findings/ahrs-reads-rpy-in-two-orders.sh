#!/usr/bin/env bash
# In ahrs, rpy=[10, 20, 30] is one rotation for a quaternion and another for a matrix.
#
# Guess: Quaternion(rpy=angles).to_DCM() equals DCM(rpy=angles): roll, pitch, yaw in the order
# of the name, in one package.
# Version: ahrs 0.4.0 (numpy 2.4.6, scipy 1.17.1 as a reference, Python 3.11).
# Behaviour: Quaternion takes roll first and yaw last; DCM takes the FIRST angle as yaw and the
# LAST as roll. Nothing is raised, both are proper rotations. Equal roll and yaw hide it.
# Output seen (roll 10, pitch 20, yaw 30 degrees):
#   Quaternion(rpy=...) has roll, pitch, yaw = 10.0 20.0 30.0
#   DCM(rpy=...)        has roll, pitch, yaw = 30.0 20.0 10.0
#   angle between the two: 32.7 degrees
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/venv"
"$folder/venv/bin/pip" install --quiet --disable-pip-version-check \
    numpy==2.4.6 scipy==1.17.1 ahrs==0.4.0
"$folder/venv/bin/python" - <<'PY'
import sys
import warnings

warnings.simplefilter("ignore")
import ahrs
import numpy as np
from scipy.spatial.transform import Rotation

angles = np.radians([10.0, 20.0, 30.0])
from_quaternion = Rotation.from_matrix(np.array(ahrs.Quaternion(rpy=angles).to_DCM()))
from_matrix = Rotation.from_matrix(np.array(ahrs.DCM(rpy=angles)))


def roll_pitch_yaw(rotation):
    return rotation.as_euler("ZYX", degrees=True)[::-1]


for name, rotation in (("Quaternion(rpy=...)", from_quaternion), ("DCM(rpy=...)", from_matrix)):
    print(f"{name:19} has roll, pitch, yaw =", " ".join(f"{value:.1f}" for value in roll_pitch_yaw(rotation)))
between = np.degrees((from_quaternion.inv() * from_matrix).magnitude())
print(f"angle between the two: {between:.1f} degrees")
same = (np.allclose(roll_pitch_yaw(from_quaternion), [10, 20, 30])
        and np.allclose(roll_pitch_yaw(from_matrix), [30, 20, 10]))
sys.exit(0 if same else "the behaviour has changed")
PY
