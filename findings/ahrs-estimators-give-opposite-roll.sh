#!/usr/bin/env bash
# The estimators of ahrs give opposite attitudes for one and the same unit at rest.
#
# Guess: Madgwick, Mahony, Tilt, AQUA and SAAM of one package return one convention of quaternion, so
# for a unit rolled by +30 degrees all of them say +30.
# Version: ahrs 0.4.0 (numpy 2.4.6, scipy 1.17.1 to read the angles, Python 3.11).
# Behaviour: Madgwick, Mahony and Tilt return body to world, AQUA and SAAM world to body, the
# conjugate, under the same attribute Q. At level, and by the size of the angle alone, nobody sees it.
# Output seen (unit at rest, rolled by +30 degrees, accelerometer +g upwards):
#   Madgwick  roll  30.0 deg
#   Mahony    roll  30.0 deg
#   Tilt      roll  30.0 deg
#   AQUA      roll -30.0 deg
#   SAAM      roll -30.0 deg
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
import numpy as np
from ahrs import filters
from scipy.spatial.transform import Rotation

SAMPLES = 3000
world_to_body = Rotation.from_euler("x", 30, degrees=True).inv()
force = np.tile(world_to_body.apply([0.0, 0.0, 9.81]), (SAMPLES, 1))
field = np.tile(world_to_body.apply([22.0, 0.0, -42.0]), (SAMPLES, 1))  # north and down
still = np.zeros((SAMPLES, 3))
estimates = {
    "Madgwick": filters.Madgwick(gyr=still, acc=force).Q[-1],
    "Mahony": filters.Mahony(gyr=still, acc=force).Q[-1],
    "Tilt": filters.Tilt(acc=force).Q[-1],
    "AQUA": filters.AQUA(gyr=still, acc=force).Q[-1],
    "SAAM": filters.SAAM(acc=force, mag=field).Q[-1],
}
rolls = {}
for name, quaternion in estimates.items():
    rolls[name] = Rotation.from_quat(np.roll(quaternion, -1)).as_euler("ZYX", degrees=True)[2]
    print(f"{name:9} roll {rolls[name]:5.1f} deg")
same = np.allclose(list(rolls.values()), [30, 30, 30, -30, -30], atol=0.2)
sys.exit(0 if same else "the behaviour has changed")
PY
