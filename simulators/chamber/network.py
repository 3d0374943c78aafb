"""Thermal network of lumps: chamber air, walls, and the unit's case, converter, accelerometer block and gyro blocks.

``C·dT/dt = G·T + …``, linear in eight temperatures, discretised exactly (matrix exponential): inputs that hold for a
step (heater, powers, room) as steps, the air's wandering at the unit's place as a straight line through it (first-order
hold; C. Van Loan, Computing integrals involving the matrix exponential, IEEE TAC 23 (1978) 395).
"""

from dataclasses import dataclass

import numpy as np

from procedures.importing import IMPORTING
from simulators.truth import Array
from simulators.truth.thermal import NODES, ChamberTruth, NetworkTruth

AIR, WALLS, CASE, CONVERTER, BLOCK, GYRO = 0, 1, 2, 3, 4, slice(5, 8)
INPUTS = ("heater_w", "ambient_c", "place_c", "unit_on")
"""Held through a step: plant's heat into the air, temperature of the room, air at the unit less air at the
controller, and the unit's power (0 or 1)."""
HEATER, AMBIENT, PLACE, POWER = range(len(NODES), len(NODES) + len(INPUTS))
RAMPED = PLACE
"""Input that moves along a straight line within a step."""


def rates(chamber: ChamberTruth, unit: NetworkTruth, door_open: bool) -> tuple[Array, Array]:
    """Return the matrices of the chamber's and the unit's heat, A (8, 8) [1/s] and B (8, 4): ``dT/dt = A·T + B·u``, u
    in the order of `INPUTS`.
    """
    nodes = len(NODES)
    capacity = np.array(
        [chamber.air_j_k, chamber.walls_j_k, unit.case_j_k, unit.converter_j_k, unit.accelerometer_block_j_k]
        + [unit.gyro_j_k] * 3
    )
    links = [
        (AIR, WALLS, chamber.air_to_walls_w_k),
        (AIR, CASE, unit.air_to_case_w_k),
        (CASE, CONVERTER, unit.case_to_converter_w_k),
        (CASE, BLOCK, unit.case_to_accelerometer_block_w_k),
        *((CASE, g, unit.case_to_gyro_w_k) for g in range(GYRO.start, GYRO.stop)),
    ]
    conductance, inputs = np.zeros((nodes, nodes)), np.zeros((nodes, len(INPUTS)))
    for i, j, g in links:
        conductance[i, j] += g
        conductance[j, i] += g
    conductance -= np.diag(conductance.sum(axis=1))
    leak = np.zeros(nodes)
    leak[WALLS] = chamber.walls_to_ambient_w_k
    leak[AIR] = chamber.door_open_w_k if door_open else 0.0
    conductance -= np.diag(leak)
    inputs[:, AMBIENT - nodes] = leak
    inputs[AIR, HEATER - nodes] = 1.0
    # The air that the case feels is the controller's plus the place's; what the case takes more, the air gives.
    inputs[CASE, PLACE - nodes] = unit.air_to_case_w_k
    inputs[AIR, PLACE - nodes] = -unit.air_to_case_w_k
    powers = (unit.case_w, unit.converter_w, unit.accelerometer_block_w, *([unit.gyro_w] * 3))
    inputs[CASE:, POWER - nodes] = powers
    return conductance / capacity[:, None], inputs / capacity[:, None]


def with_held_air(a: Array, b: Array) -> tuple[Array, Array]:
    """The same network where the air's temperature is given from outside, and holds for a step."""
    held_a, held_b = a.copy(), b.copy()
    held_a[AIR], held_b[AIR] = 0.0, 0.0
    return held_a, held_b


@dataclass(frozen=True)
class Step:
    """One exact time step: ``T(t + Δ) = M·[T(t), u, u_ramped(t + Δ)]``, M of shape (8, 13)."""

    matrix: Array

    @classmethod
    def of(cls, a: Array, b: Array, step_s: float) -> "Step":
        """Discretise by Van Loan: ``exp([[A, B, 0], [0, 0, ramp], [0, 0, 0]]·Δ)`` gives held and ramped parts alike."""
        with IMPORTING:
            from scipy.linalg import expm  # half a second to import: a service that starts does not wait for it

        nodes, inputs = b.shape
        whole = np.zeros((nodes + inputs + 1, nodes + inputs + 1))
        whole[:nodes, :nodes], whole[:nodes, nodes:-1] = a, b
        whole[RAMPED, -1] = 1.0 / step_s  # the last state is how far the ramped input goes within the step
        grown = np.asarray(expm(whole * step_s), dtype=np.float64)[:nodes]
        grown[:, RAMPED] -= grown[:, -1]  # in terms of its value at the end instead of its change
        return cls(grown)


def steady(a: Array, b: Array, u: Array) -> Array:
    """Compute the steady temperatures, (8,) [°C], for inputs (4,) held for ever."""
    return np.asarray(np.linalg.solve(a, -b @ u), dtype=np.float64)
