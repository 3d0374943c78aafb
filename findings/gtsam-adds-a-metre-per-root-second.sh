#!/usr/bin/env bash
# gtsam claims metres of uncertainty for the position of a unit whose noise makes centimetres.
#
# Guess: a preintegration with the accelerometer's and the gyro's noise densities set has the uncertainty that these
# make: sd of position N sqrt(t^3/3).
# Version: gtsam 4.3.0 (numpy 2.4.6, Python 3.11).
# Behaviour: a third density, of the integration itself, has the value 1 m/sqrt(s) until somebody sets it, and the
# two others 1 as well. With both noises of a unit set and the third not, ten seconds at rest give a position that is
# uncertain by 3.16 m instead of 0.018 m; the velocity is right. An estimator weighs the unit 30 000 times too low,
# and nothing says so.
# Output seen (accelerometer 1e-3 m/s^2/sqrt(Hz), gyro 1e-5 rad/s/sqrt(Hz), 10 s at rest):
#   sd of velocity, up          0.0032 m/s, theory 0.0032
#   sd of position, up          3.1623 m, theory 0.0183
#   sd with the third set to 0  0.0183 m
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/venv"
"$folder/venv/bin/pip" install --quiet --disable-pip-version-check numpy==2.4.6 gtsam==4.3.0
"$folder/venv/bin/python" - <<'PY'
import sys

import gtsam
import numpy as np

ACCELEROMETER, GYRO, TIME, RATE, GRAVITY = 1e-3, 1e-5, 10.0, 100.0, 9.80665


def at_rest(integration=None):
    """Standard deviations of position and velocity, upwards, after a time at rest."""
    noise = gtsam.PreintegrationParams.MakeSharedU(GRAVITY)
    noise.setAccelerometerCovariance(np.eye(3) * ACCELEROMETER**2)
    noise.setGyroscopeCovariance(np.eye(3) * GYRO**2)
    if integration is not None:
        noise.setIntegrationCovariance(np.eye(3) * integration)
    measured = gtsam.PreintegratedImuMeasurements(noise, gtsam.imuBias.ConstantBias())
    for _ in range(int(TIME * RATE)):
        measured.integrateMeasurement(np.array([0.0, 0.0, GRAVITY]), np.zeros(3), 1 / RATE)
    sd = np.sqrt(np.diag(measured.preintMeasCov()))
    return sd[5], sd[8]


velocity_theory = ACCELEROMETER * np.sqrt(TIME)
position_theory = ACCELEROMETER * np.sqrt(TIME**3 / 3)
position, velocity = at_rest()
alone, _ = at_rest(integration=0.0)
print(f"sd of velocity, up          {velocity:.4f} m/s, theory {velocity_theory:.4f}")
print(f"sd of position, up          {position:.4f} m, theory {position_theory:.4f}")
print(f"sd with the third set to 0  {alone:.4f} m")
same = abs(velocity / velocity_theory - 1) < 0.01 and position > 100 * position_theory and alone < 1.05 * position_theory
sys.exit(0 if same else "the behaviour has changed")
PY
