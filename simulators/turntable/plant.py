"""The table as MuJoCo sees it: bodies, hinges, servo. The one file that imports mujoco.

World axes east, north, up; gravity along −z. Bodies: base (azimuth, tilt) > outer (hinge y, vertical) > middle (hinge
z) > inner (hinge x) > site ``unit``. The text below, with its numbers by `repr`, is the model's only source. Servo:
MuJoCo's own PID, 20 Hz, with integral (without it arcseconds remain) and a limit on it. Inertias are invented.
"""

from math import ceil, pi, sin

import mujoco
import numpy as np
from mujoco import rollout

from procedures.bench.errors import DeviceFault
from simulators.truth import Array, SiteTruth, TableTruth
from simulators.turntable.kinematics import X, Y, Z, wobble_vector
from simulators.turntable.profile import Profile

STEP_S = 0.00125
"""Longest integration step [s]; a whole number of steps makes one tick."""
BANDWIDTH_RAD_S = 2.0 * pi * 20.0
INTEGRAL_SHARE = 0.15
INTEGRAL_LIMIT_RAD_S = 1e-3
TORQUE_LIMIT_N_M = 450.0
INERTIA_KG_M2 = {"outer": 12.0, "middle": 5.0, "inner": 1.5}
UNBALANCE_KG, UNBALANCE_M = 0.5, 0.15

# MuJoCo would write its warnings to a file in the working directory; `Plant.run` reads their numbers instead.
mujoco.set_mju_user_warning(lambda _text: None)  # pyright: ignore[reportAttributeAccessIssue]

Quaternion = tuple[float, float, float, float]


def _quaternion(vector_rad: Array) -> Quaternion:
    """Unit quaternion (w, x, y, z) of a rotation vector (3,)."""
    size = float(np.linalg.norm(vector_rad))
    scale = 0.5 if size == 0.0 else sin(0.5 * size) / size
    x, y, z = (scale * vector_rad).tolist()
    return float(np.cos(0.5 * size)), x, y, z


def _product(p: Quaternion, q: Quaternion) -> Quaternion:
    """Compute the Hamilton product p·q."""
    pw, px, py, pz = p
    qw, qx, qy, qz = q
    w = pw * qw - px * qx - py * qy - pz * qz
    x = pw * qx + px * qw + py * qz - pz * qy
    y = pw * qy - px * qz + py * qw + pz * qx
    z = pw * qz + px * qy - py * qx + pz * qw
    return w, x, y, z


def _about(axis: int, angle_rad: float) -> Quaternion:
    vector = np.zeros(3)
    vector[axis] = angle_rad
    return _quaternion(vector)


def _numbers(values: tuple[float, ...]) -> str:
    return " ".join(repr(float(v)) for v in values)


def _base_quaternion(table: TableTruth, azimuth_deg: float) -> Quaternion:
    arcsec = pi / 648000.0
    lean = _quaternion(arcsec * np.array([-table.base_tilt_north_arcsec, table.base_tilt_east_arcsec, 0.0]))
    heading = _about(Z, -(azimuth_deg * pi / 180.0 + table.azimuth_error_arcsec * arcsec))
    return _product(_product(lean, heading), (0.5, 0.5, 0.5, 0.5))


def model_text(table: TableTruth, site: SiteTruth, azimuth_deg: float, step_s: float) -> str:
    """Build the MuJoCo model as MJCF text."""
    arcsec = pi / 648000.0
    middle = _about(X, table.outer_middle_nonorthogonality_arcsec * arcsec)
    inner = _about(Y, table.middle_inner_nonorthogonality_arcsec * arcsec)
    inertia = INERTIA_KG_M2
    carried = {
        "inner": inertia["inner"],
        "middle": inertia["inner"] + inertia["middle"],
        "outer": sum(inertia.values()),
    }

    def inertial(name: str) -> str:
        return f'<inertial pos="0 0 0" mass="20" diaginertia="{_numbers((inertia[name],) * 3)}"/>'

    def servo(name: str) -> str:
        kp = carried[name] * BANDWIDTH_RAD_S**2
        gains = f'kp="{kp!r}" kv="{2.0 * kp / BANDWIDTH_RAD_S!r}" ki="{INTEGRAL_SHARE * kp * BANDWIDTH_RAD_S!r}"'
        torque = f'forcerange="{_numbers((-TORQUE_LIMIT_N_M, TORQUE_LIMIT_N_M))}"'
        return f'<pid name="{name}" joint="{name}" input="pos vel" {gains} imax="{INTEGRAL_LIMIT_RAD_S!r}" {torque}/>'

    return f"""
<mujoco model="turntable">
  <compiler autolimits="true"/>
  <option timestep="{step_s!r}" integrator="implicitfast" gravity="0 0 {-site.gravity_m_s2!r}">
    <flag autoreset="disable" contact="disable" constraint="disable"/>
  </option>
  <worldbody>
    <body name="base" quat="{_numbers(_base_quaternion(table, azimuth_deg))}">
      <body name="outer">
        <joint name="outer" type="hinge" axis="0 1 0"/>{inertial("outer")}
        <body name="middle" quat="{_numbers(middle)}">
          <joint name="middle" type="hinge" axis="0 0 1"/>{inertial("middle")}
          <body name="inner" quat="{_numbers(inner)}">
            <joint name="inner" type="hinge" axis="1 0 0"/>{inertial("inner")}
            <body name="unbalance" pos="0 {UNBALANCE_M!r} 0">
              <inertial pos="0 0 0" mass="{UNBALANCE_KG!r}" diaginertia="0.001 0.001 0.001"/>
            </body>
            <site name="unit"/>
          </body>
        </body>
      </body>
    </body>
  </worldbody>
  <actuator>{servo("outer")}{servo("middle")}{servo("inner")}</actuator>
</mujoco>"""


class Plant:
    """Three axes under servo. Angles here are true joint angles [rad]; the device that owns the plant wraps them."""

    def __init__(self, table: TableTruth, site: SiteTruth, azimuth_deg: float, rate_hz: float) -> None:
        self.steps_per_tick = max(1, ceil(1.0 / (rate_hz * STEP_S) - 1e-9))
        self.step_s = 1.0 / (rate_hz * self.steps_per_tick)
        self._table = table
        self._model = mujoco.MjModel.from_xml_string(  # pyright: ignore[reportAttributeAccessIssue]
            model_text(table, site, azimuth_deg, self.step_s)
        )
        self._data = mujoco.MjData(self._model)  # pyright: ignore[reportAttributeAccessIssue]
        self._bodies = {name: self._model.body(name).id for name in ("outer", "middle", "inner")}
        self._quats = self._model.body_quat.copy()
        self._state: Array = np.zeros(1 + 3 + 3 + 3)

    @property
    def angles_rad(self) -> Array:
        """True joint angles, (3,) [rad]."""
        return self._state[1:4].copy()

    @property
    def rates_rad_s(self) -> Array:
        """Current joint rates, (3,) [rad/s]."""
        return self._state[4:7].copy()

    @property
    def integral(self) -> Array:
        """State of the servo's integrators, (3,)."""
        return self._state[7:10].copy()

    def put(self, angles_rad: Array, integral: Array | None = None) -> None:
        """Stand still at some joint angles; the integrators keep their state unless `integral` is given."""
        held = self.integral if integral is None else integral
        self._state = np.concatenate([[0.0], angles_rad, np.zeros(3), held])

    def shift(self, angles_rad: Array) -> None:
        """Add whole turns to the axes' angles; the motion continues unchanged."""
        self._state[1:4] += angles_rad

    def run(self, profile: Profile, first_step: int, steps: int) -> Array:
        """Follow a profile for some steps from its step `first_step`; joint angles, (steps + 1, 3).

        A step's setpoint is the profile at the step's beginning. Raises `DeviceFault`.
        """
        times: Array = np.arange(first_step, first_step + steps, dtype=np.float64) * self.step_s
        position, rate = profile.at(times)
        control = np.empty((steps, 6))
        control[:, 0::2], control[:, 1::2] = position, rate
        states = np.asarray(rollout.rollout(self._model, self._data, self._state[None], control[None])[0])[0]
        if not np.all(np.isfinite(states)) or np.any(self._data.warning.number):
            raise DeviceFault("the simulated table became unstable")
        path = np.concatenate([self._state[None, 1:4], states[:, 1:4]])
        self._state = np.array(states[-1])
        return path

    def attitude(self) -> Array:
        """``rot_enu_b`` of the unit where the table stands, (3, 3), from MuJoCo's own kinematics and with wobble."""
        self._set_wobble()
        self._data.qpos[:] = self._state[1:4]
        self._data.qvel[:] = 0.0
        mujoco.mj_kinematics(self._model, self._data)  # pyright: ignore[reportAttributeAccessIssue]
        return np.array(self._data.site("unit").xmat, dtype=np.float64).reshape(3, 3)

    def _set_wobble(self) -> None:
        """Lean each axis' body by its wobble at the present angle."""
        table = self._table
        amplitudes = {
            "outer": (Y, table.outer_wobble_arcsec),
            "middle": (Z, table.middle_wobble_arcsec),
            "inner": (X, table.inner_wobble_arcsec),
        }
        for index, (name, (axis, amplitude)) in enumerate(amplitudes.items()):
            if amplitude > 0.0:
                body = self._bodies[name]
                lean = _quaternion(wobble_vector(axis, amplitude, self._state[1 + index : 2 + index])[0])
                w, x, y, z = self._quats[body].tolist()
                self._model.body_quat[body] = _product((w, x, y, z), lean)
