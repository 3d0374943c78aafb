#!/usr/bin/env bash
# navpy gives the Earth's rate in north, east, down with the vertical part on the east axis and nothing on down.
#
# Guess: earthrate(latitude) is (W cos L, 0, -W sin L), as the equation of Groves that its text quotes; and
# navrate(..., lat_unit="rad") is the same rate as with degrees.
# Version: navpy 1.0 (numpy 2.4.6, Python 3.11).
# Behaviour: the vertical part stands in the second place and the third is zero. The norm is right, so a check of the
# magnitude passes; at the equator the answer is right altogether. A gyro calibrated against it at 50 degrees north
# has an east axis that is 11.5 deg/h off and a vertical one that is 11.5 deg/h off. navrate takes the tangent of the
# latitude as if it were degrees, whatever the unit given: its vertical part is 78 times too small at 50 degrees.
# Output seen:
#   earthrate at 50 degrees [deg/h]: north 9.668 east -11.522 down 0.000
#   Groves (2.75)           [deg/h]: north 9.668 east 0.000 down -11.522
#   navrate down, latitude in degrees -3.7296e-06 rad/s, in radians -4.7669e-08 rad/s
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/venv"
"$folder/venv/bin/pip" install --quiet --disable-pip-version-check numpy==2.4.6 NavPy==1.0
"$folder/venv/bin/python" - <<'PY'
import sys
import warnings

warnings.simplefilter("ignore")
import navpy
import numpy as np

LATITUDE, RATE = 50.0, 7.292115e-5


def told(rate):
    return " ".join(f"{name} {value + 0.0:.3f}" for name, value in zip(("north", "east", "down"), rate))


def in_degrees_per_hour(rate):
    return np.degrees(rate) * 3600


groves = RATE * np.array([np.cos(np.radians(LATITUDE)), 0.0, -np.sin(np.radians(LATITUDE))])
found = navpy.earthrate(LATITUDE)
print("earthrate at 50 degrees [deg/h]:", told(in_degrees_per_hour(found)))
print("Groves (2.75)           [deg/h]:", told(in_degrees_per_hour(groves)))
degrees = navpy.navrate(10.0, 20.0, 0.0, LATITUDE, 100.0)[2]
radians = navpy.navrate(10.0, 20.0, 0.0, np.radians(LATITUDE), 100.0, lat_unit="rad")[2]
print(f"navrate down, latitude in degrees {degrees:.4e} rad/s, in radians {radians:.4e} rad/s")
same = np.allclose(found, groves[[0, 2, 1]]) and not np.isclose(degrees, radians)
sys.exit(0 if same else "the behaviour has changed")
PY
