#!/usr/bin/env bash
# Navigation packages agree on the quaternion of an attitude and give transposed matrices for it.
#
# Guess: where two packages give the same quaternion for the same yaw, pitch and roll, they give
# the same rotation matrix, since the matrix follows from the quaternion.
# Versions: navpy 1.0, PSpincalc 0.2.7, scipy 1.17.1 (numpy 2.4.6, Python 3.11).
# Behaviour: the quaternions are equal to the last digit (only scipy's scalar is last), while
# navpy (angle2dcm and quat2dcm) and PSpincalc (EA2DCM) give the matrix from world to body, and scipy the
# one from body to world. Comparing quaternions proves nothing about the matrices.
# Output seen (yaw 30, pitch 20, roll 10 degrees):
#   scipy      q = 0.9515 0.0381 0.1893 0.2393   first row of the matrix = 0.814 -0.441 0.379
#   navpy      q = 0.9515 0.0381 0.1893 0.2393   first row of the matrix = 0.814 0.470 -0.342
#   PSpincalc  q = 0.9515 0.0381 0.1893 0.2393   first row of the matrix = 0.814 0.470 -0.342
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/venv"
"$folder/venv/bin/pip" install --quiet --disable-pip-version-check \
    numpy==2.4.6 scipy==1.17.1 navpy==1.0 PSpincalc==0.2.7
"$folder/venv/bin/python" - <<'PY'
import sys
import warnings

warnings.simplefilter("ignore")
import navpy
import numpy as np
import PSpincalc
from scipy.spatial.transform import Rotation

angles = np.radians([30.0, 20.0, 10.0])  # yaw, pitch, roll
reference = Rotation.from_euler("ZYX", angles)
scalar, vector = navpy.angle2quat(*angles)
seen = {
    "scipy": (np.roll(reference.as_quat(), 1), reference.as_matrix()),
    "navpy": (np.array([scalar, *vector]), navpy.quat2dcm(scalar, vector)),
    "PSpincalc": (PSpincalc.EA2Q(angles[None], "zyx").ravel(), PSpincalc.EA2DCM(angles[None], "zyx").reshape(3, 3)),
}
for name, (quaternion, matrix) in seen.items():
    print(f"{name:10} q =", " ".join(f"{value:.4f}" for value in quaternion),
          "  first row of the matrix =", " ".join(f"{value:.3f}" for value in matrix[0]))
quaternion, matrix = seen["scipy"]
same = np.allclose(navpy.angle2dcm(*angles), matrix.T)
for name in ("navpy", "PSpincalc"):
    same = same and np.allclose(seen[name][0], quaternion) and np.allclose(seen[name][1], matrix.T)
sys.exit(0 if same else "the behaviour has changed")
PY
