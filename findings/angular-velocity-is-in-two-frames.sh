#!/usr/bin/env bash
# Packages disagree about the frame of an angular velocity, and none of the names says which.
#
# Guess: an angular velocity taken from attitude quaternions (body to world) is what a gyro measures,
# in body axes; and integrating a gyro's rate from a start attitude gives the same attitude everywhere.
# Versions: numpy-quaternion 2024.0.13, ahrs 0.4.0, rowan 1.3.2, pyquaternion 0.9.9,
# scipy 1.17.1 (numpy 2.4.6, Python 3.11).
# Behaviour: angular_velocity() of numpy-quaternion gives world axes, those of ahrs and of scipy's
# RotationSpline body axes. rowan's integrate() turns about world axes, pyquaternion's about body
# axes. With the unit upright the two are the same, so a test with one turn about z sees nothing.
# Output seen (unit lying on its side, turning at 1 rad/s about its own z):
#   numpy-quaternion rate:  0.00 -1.00  0.00
#   ahrs rate:              0.00  0.00  1.00
#   scipy rate:             0.00  0.00  1.00
#   true attitude after 1 s:   0.621  0.621 -0.339  0.339
#   pyquaternion integrated:   0.621  0.621 -0.339  0.339
#   rowan integrated:          0.621  0.621  0.339  0.339
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/venv"
"$folder/venv/bin/pip" install --quiet --disable-pip-version-check \
    numpy==2.4.6 scipy==1.17.1 numpy-quaternion==2024.0.13 ahrs==0.4.0 rowan==1.3.2 pyquaternion==0.9.9
"$folder/venv/bin/python" - <<'PY'
import sys
import warnings

warnings.simplefilter("ignore")
import ahrs
import numpy as np
import pyquaternion
import quaternion
import rowan
from scipy.spatial.transform import Rotation, RotationSpline

times = np.arange(201) / 100
attitude = Rotation.from_euler("x", 90, degrees=True) * Rotation.from_rotvec(np.outer(times, [0, 0, 1.0]))
scalar_first = np.roll(attitude.as_quat(), 1, axis=1)
rates = {
    "numpy-quaternion": quaternion.angular_velocity(quaternion.from_float_array(scalar_first), times)[100],
    "ahrs": ahrs.QuaternionArray(scalar_first).angular_velocities(0.01)[100],
    "scipy": RotationSpline(times, attitude)(1.0, 1),
}
for name, rate in rates.items():
    print(f"{name + ' rate:':22}", " ".join(f"{value + 0.0:5.2f}" for value in np.round(rate, 2)))
turned = pyquaternion.Quaternion(scalar_first[0])
turned.integrate([0, 0, 1.0], 1.0)
ends = {
    "true attitude after 1 s": scalar_first[100],
    "pyquaternion integrated": turned.elements,
    "rowan integrated": rowan.calculus.integrate(scalar_first[0], np.array([0, 0, 1.0]), 1.0),
}
for name, end in ends.items():
    print(f"{name + ':':25}", " ".join(f"{value:6.3f}" for value in end))
true = ends["true attitude after 1 s"]
same = (np.allclose(rates["numpy-quaternion"], [0, -1, 0], atol=1e-3)
        and np.allclose(rates["ahrs"], [0, 0, 1], atol=1e-3)
        and np.allclose(rates["scipy"], [0, 0, 1], atol=1e-3)
        and np.allclose(ends["pyquaternion integrated"], true, atol=1e-6)
        and not np.allclose(ends["rowan integrated"], true, atol=0.1))
sys.exit(0 if same else "the behaviour has changed")
PY
