#!/usr/bin/env bash
# framelinacc of MuJoCo reads 9.81 m/s^2 upwards for a body at rest, and zero for one in free fall.
#
# Guess: "accelerometer" measures specific force in the body's axes, while "framelinacc", the "linear
# acceleration of the frame in global coordinates", is the kinematic acceleration: 0 at rest and -9.81
# in free fall, the truth against which a simulated accelerometer is checked.
# Version: mujoco-core 4.0.1 (numpy 2.4.6, Python 3.11).
# Behaviour: framelinacc is specific force too, only turned into world axes. The rate of change of
# framelinvel of the same object is what was guessed. Adding gravity to framelinacc to get a specific
# force counts it twice.
# Output seen (z in m/s^2):
#   at rest:   accelerometer 9.81, framelinacc 9.81, change of framelinvel  0.00
#   falling:   accelerometer 0.00, framelinacc 0.00, change of framelinvel -9.81
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/venv"
"$folder/venv/bin/pip" install --quiet --disable-pip-version-check \
    numpy==2.4.6 mujoco-core==4.0.1
"$folder/venv/bin/python" - <<'PY'
import sys

import mujoco

MODEL = '''
<mujoco>
  <option timestep="0.001" gravity="0 0 -9.81"/>
  <worldbody>
    <body pos="0 0 1">{joint}<geom type="box" size="0.1 0.1 0.1" mass="1"/><site name="unit"/></body>
  </worldbody>
  <sensor>
    <accelerometer site="unit"/>
    <framelinacc objtype="site" objname="unit"/>
    <framelinvel objtype="site" objname="unit"/>
  </sensor>
</mujoco>
'''
seen = []
for name, joint in (("at rest:", ""), ("falling:", "<freejoint/>")):
    model = mujoco.MjModel.from_xml_string(MODEL.format(joint=joint))
    data = mujoco.MjData(model)
    speeds = []
    for _ in range(10):
        mujoco.mj_step(model, data)
        speeds.append(data.sensordata[8])
    change = (speeds[-1] - speeds[-2]) / model.opt.timestep
    row = [data.sensordata[2], data.sensordata[5], change]
    seen += row
    print(f"{name:10} accelerometer {row[0] + 0.0:.2f}, framelinacc {row[1] + 0.0:.2f}, "
          f"change of framelinvel {row[2] + 0.0:5.2f}")
same = all(abs(a - b) < 1e-6 for a, b in zip(seen, [9.81, 9.81, 0, 0, 0, -9.81]))
sys.exit(0 if same else "the behaviour has changed")
PY
