#!/usr/bin/env bash
# Interpolating an attitude log with pytransform3d turns the unit backwards by almost a turn.
#
# Guess: halfway between two attitudes that are 10 degrees apart is 5 degrees, whatever the signs of the
# quaternions, since q and -q are one attitude. A log that keeps the scalar positive changes sign once a turn.
# Versions: pytransform3d 3.17.0; pyquaternion 0.9.9, numpy-quaternion 2024.0.13, rowan 1.3.2,
# ahrs 0.4.0 and scipy 1.17.1 for comparison (numpy 2.4.6, Python 3.11).
# Behaviour: quaternion_slerp of pytransform3d goes the long way, 355 degrees in one step, unless told
# shortest_path=True; the five others take the short way by themselves. A table's log that is
# resampled to another clock so gains a half turn at one sample in each revolution.
# Output seen (from 175 to 185 degrees, halfway is 180):
#   pytransform3d                       0.0
#   pytransform3d, shortest_path=True 180.0
#   pyquaternion                      180.0
#   numpy-quaternion                  180.0
#   rowan                             180.0
#   ahrs                              180.0
#   scipy                             180.0
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/venv"
"$folder/venv/bin/pip" install --quiet --disable-pip-version-check \
    numpy==2.4.6 scipy==1.17.1 pytransform3d==3.17.0 pyquaternion==0.9.9 \
    numpy-quaternion==2024.0.13 rowan==1.3.2 ahrs==0.4.0
"$folder/venv/bin/python" - <<'PY'
import sys
import warnings

warnings.simplefilter("ignore")
import ahrs
import numpy as np
import pyquaternion
import quaternion
import rowan
from pytransform3d.rotations import quaternion_slerp
from scipy.spatial.transform import Rotation, Slerp


def turned(degrees):
    # Scalar first and never negative, as many loggers write it.
    half = np.radians(degrees) / 2
    q = np.array([np.cos(half), 0.0, 0.0, np.sin(half)])
    return q if q[0] >= 0 else -q


def heading(q):
    q = np.ravel(q)
    return np.degrees(2 * np.arctan2(q[3], q[0])) % 360


a, b = turned(175), turned(185)
named = pyquaternion.Quaternion
scipy_way = Slerp([0, 1], Rotation.from_quat(np.roll([a, b], -1, axis=1)))(0.5)
halfway = {
    "pytransform3d": quaternion_slerp(a, b, 0.5),
    "pytransform3d, shortest_path=True": quaternion_slerp(a, b, 0.5, shortest_path=True),
    "pyquaternion": named.slerp(named(a), named(b), 0.5).elements,
    "numpy-quaternion": quaternion.as_float_array(
        quaternion.slerp(quaternion.quaternion(*a), quaternion.quaternion(*b), 0, 1, 0.5)),
    "rowan": rowan.interpolate.slerp(a, b, 0.5),
    "ahrs": ahrs.common.quaternion.slerp(a, b, [0.5]),
    "scipy": np.roll(scipy_way.as_quat(), 1),
}
seen = {name: heading(q) for name, q in halfway.items()}
for name, value in seen.items():
    print(f"{name:33} {value:5.1f}")
values = list(seen.values())
off = abs((values[0] + 180) % 360 - 180)
sys.exit(0 if off < 0.1 and np.allclose(values[1:], 180, atol=0.1) else "the behaviour has changed")
PY
