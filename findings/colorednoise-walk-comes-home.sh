#!/usr/bin/env bash
# A random walk made by colorednoise ends where it began.
#
# Guess: powerlaw_psd_gaussian(2, n) is a random walk as a rate random walk of a gyro is: after n steps it is away
# from its start by the step times the root of n, and a longer record has the same steps.
# Version: colorednoise 2.2.0 (numpy 2.4.6, allantools 2024.6 as a reference, Python 3.11).
# Behaviour: the record is one period of a periodic signal. Its last value is one step from its first, however long it
# is, and the Allan deviation bends down at long times, as if the walk were bounded. The whole record is scaled to a
# standard deviation of about 1, so the step, which a gyro's data sheet gives, shrinks with the root of the length.
# A method that looks for K in it finds too little. Make a record several times as long, cut a piece, and scale it.
# Output seen (400 records of 4096 values; 1 is what a random walk of the same Allan deviation at 16 steps has):
#   distance between first and last value: 0.014
#   Allan deviation at 16, 1024 and 1920 steps: 1.00 0.82 0.56
#   step of records of 1024, 4096, 16384 values: 0.095 0.048 0.024
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/venv"
"$folder/venv/bin/pip" install --quiet --disable-pip-version-check numpy==2.4.6 allantools==2024.6 colorednoise==2.2.0
"$folder/venv/bin/python" - <<'PY'
import sys

import allantools
import colorednoise
import numpy as np

COUNT, LENGTH, TIMES = 400, 4096, [16, 1024, 1920]
random = np.random.default_rng(7)
records = colorednoise.powerlaw_psd_gaussian(2, (COUNT, LENGTH), random_state=random)
squares = [allantools.oadev(r, rate=1, data_type="freq", taus=TIMES)[1] ** 2 for r in records]
found = np.sqrt(np.mean(squares, axis=0))
# of a sum of unit steps, means over m values (in discrete time, exactly): (2 m^2 + 1) / (6 m)
ratios = found / [np.sqrt((2 * m * m + 1) / (6 * m)) for m in TIMES]
step, ratios = ratios[0], ratios / ratios[0]
away = np.sqrt(np.mean((records[:, -1] - records[:, 0]) ** 2)) / (step * np.sqrt(LENGTH - 1))
print(f"distance between first and last value: {away:.3f}")
print("Allan deviation at 16, 1024 and 1920 steps:", *(f"{r:.2f}" for r in ratios))
steps = [
    np.sqrt(np.mean(np.diff(colorednoise.powerlaw_psd_gaussian(2, (50, n), random_state=random)) ** 2))
    for n in (1024, 4096, 16384)
]
print("step of records of 1024, 4096, 16384 values:", *(f"{s:.3f}" for s in steps))
same = away < 0.05 and ratios[2] < 0.75 and 1.8 < steps[0] / steps[1] < 2.2
sys.exit(0 if same else "the behaviour has changed")
PY
