#!/usr/bin/env bash
# The error that allantools returns with an Allan deviation is many times too small at long times.
#
# Guess: the third array that oadev returns is a one-sigma error of the deviation, so it grows
# towards long averaging times, where few independent clusters are left.
# Version: allantools 2024.6 (numpy 2.4.6, scipy 1.17.1, Python 3.11).
# Behaviour: the error is deviation / sqrt(n), n being the number of overlapping differences,
# as if they were independent. n hardly falls, so the relative error stays near 2 % where the
# deviation of one record really scatters by 35 %: 16 times too small. A fit with weights from
# these errors trusts the worst points. edf_greenhall() with confidence_interval() is the way.
# Output seen (200 records of 4096 samples of white noise):
#   tau    1 s: returned error  1.6 %, real scatter  1.4 %, ratio  0.9
#   tau   16 s: returned error  1.6 %, real scatter  3.7 %, ratio  2.4
#   tau  256 s: returned error  1.7 %, real scatter 16.0 %, ratio  9.6
#   tau 1024 s: returned error  2.2 %, real scatter 35.1 %, ratio 15.9
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/venv"
"$folder/venv/bin/pip" install --quiet --disable-pip-version-check \
    numpy==2.4.6 scipy==1.17.1 allantools==2024.6
"$folder/venv/bin/python" - <<'PY'
import sys

import allantools
import numpy as np

generator = np.random.default_rng(1)
deviations, errors = [], []
for _ in range(200):
    record = generator.standard_normal(4096)
    taus, deviation, error, _ = allantools.oadev(
        record, rate=1, data_type="freq", taus=[1, 16, 256, 1024])
    deviations.append(deviation)
    errors.append(error)
mean = np.mean(deviations, axis=0)
returned = np.mean(errors, axis=0) / mean
real = np.std(deviations, axis=0) / mean
for tau, a, b in zip(taus, returned, real):
    print(f"tau {tau:4.0f} s: returned error {100 * a:4.1f} %, real scatter {100 * b:4.1f} %, ratio {b / a:4.1f}")
same = returned[-1] < 0.03 and real[-1] > 0.25 and real[2] / returned[2] > 6 and real[0] / returned[0] < 1.3
sys.exit(0 if same else "the behaviour has changed")
PY
