#!/usr/bin/env bash
# The ready-made kinematic filter of filterpy measures the sum of its axes.
#
# Guess: kinematic_kf(dim=2, order=1, dim_z=2) is a filter of two axes with position and rate, whose two
# measurements are the two positions: rows 1 0 0 0 and 0 0 1 0 of H.
# Version: filterpy 2.0.0 (numpy 2.4.6, scipy 1.17.1, Python 3.11).
# Behaviour: every row of H is 1 0 1 0, so each measurement is predicted as position x plus position y.
# Fed with an axis at 30 and one at 20 degrees, both estimates settle at 12.5, half of the mean, with
# small covariance. The process noise is the identity whatever dt is. With dim=1 all is well, and
# F is right in both cases: set H and Q by hand.
# Output seen:
#   H: [[1. 0. 1. 0.] [1. 0. 1. 0.]]
#   axes at 30 and 20 degrees for 200 samples: estimates 12.50 and 12.50
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/venv"
"$folder/venv/bin/pip" install --quiet --disable-pip-version-check \
    numpy==2.4.6 scipy==1.17.1 filterpy==2.0.0
"$folder/venv/bin/python" - <<'PY'
import sys
import warnings

warnings.simplefilter("ignore")
import numpy as np
from filterpy.common import kinematic_kf

kalman = kinematic_kf(dim=2, order=1, dt=0.1, dim_z=2)
print("H:", " ".join(str(kalman.H).split()))
for _ in range(200):
    kalman.predict()
    kalman.update(np.array([[30.0], [20.0]]))
x, y = float(kalman.x[0, 0]), float(kalman.x[2, 0])
print(f"axes at 30 and 20 degrees for 200 samples: estimates {x:.2f} and {y:.2f}")
same = np.array_equal(kalman.H, [[1, 0, 1, 0], [1, 0, 1, 0]]) and abs(x - 12.5) < 0.1 and abs(y - 12.5) < 0.1
sys.exit(0 if same else "the behaviour has changed")
PY
