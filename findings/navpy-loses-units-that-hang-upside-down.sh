#!/usr/bin/env bash
# navpy turns the attitude of a unit that was turned by half a turn into NaN.
#
# Guess: dcm2quat gives a quaternion for every attitude, the twelve of a calibration among them.
# Version: navpy 1.0 (numpy 2.4.6, scipy 1.17.1 as a reference, Python 3.11).
# Behaviour: the vector part is divided by the scalar part, which is zero for any half turn: the answer is
# (0, [nan nan nan]) with at most a RuntimeWarning of numpy. Near a half turn the digits go: short of it by 1e-8 rad
# the quaternion is off by 0.03, several degrees. Of 24 attitudes with axes along the table's, nine are lost.
# Output seen:
#   24 attitudes along the table's axes: 9 are NaN
#   error of the quaternion, short of a half turn by 1e-3, 1e-6, 1e-8 rad: 1e-10 4e-05 3e-02
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/venv"
"$folder/venv/bin/pip" install --quiet --disable-pip-version-check numpy==2.4.6 scipy==1.17.1 NavPy==1.0
"$folder/venv/bin/python" - <<'PY'
import sys
import warnings

warnings.simplefilter("ignore")
import navpy
import numpy as np
from scipy.spatial.transform import Rotation


def by_navpy(rotation):
    """Quaternion of the direction cosines from the reference frame to the body, as navpy understands them."""
    scalar, vector = navpy.dcm2quat(rotation.as_matrix().T)
    return np.array([scalar, *vector])


group = Rotation.create_group("O")
lost = sum(not np.isfinite(by_navpy(attitude)).all() for attitude in group)
print(f"24 attitudes along the table's axes: {lost} are NaN")
axis, errors = np.array([1.0, 2.0, 2.0]) / 3, []
for short in (1e-3, 1e-6, 1e-8):
    rotation = Rotation.from_rotvec((np.pi - short) * axis)
    right = rotation.as_quat(canonical=True)[[3, 0, 1, 2]]
    errors.append(np.abs(by_navpy(rotation) - right).max())
print("error of the quaternion, short of a half turn by 1e-3, 1e-6, 1e-8 rad:", *(f"{e:.0e}" for e in errors))
sys.exit(0 if lost == 9 else "the behaviour has changed")
PY
