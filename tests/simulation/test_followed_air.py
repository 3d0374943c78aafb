"""A simulated unit in the air of a real chamber, against the same network integrated by SciPy."""

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from simulators.chamber.device import SimChamber
from simulators.chamber.network import AIR, rates
from simulators.truth import default_bench, default_unit

SECONDS, JUMP_S = 600, 200


def test_the_unit_follows_the_given_air_and_its_own_power() -> None:
    truth, unit = default_bench().chamber, default_unit().thermal
    chamber = SimChamber(truth, unit, seed=1, rate_hz=1.0, now_s=lambda: 0.0)
    chamber.follow(35.0)
    chamber.unit_power(True)
    found = [chamber.advance(JUMP_S).temperatures_c]
    chamber.follow(-20.0)
    found.append(chamber.advance(SECONDS - JUMP_S).temperatures_c)
    a, b = rates(truth, unit.network, False)
    powered = np.array([0.0, truth.ambient_c, 0.0, 1.0])

    def slope(t: float, temperatures: np.ndarray) -> np.ndarray:
        held = temperatures.copy()
        held[AIR] = 35.0 if t < JUMP_S else -20.0
        change = a @ held + b @ powered
        change[AIR] = 0.0
        return change

    state, expected = np.full(8, 35.0), []
    for begin, end in ((0, JUMP_S), (JUMP_S, SECONDS)):
        at = np.arange(begin + 1, end + 1)
        # Up to the air's jump and from there on: a step that goes over the jump would smear it.
        inside = solve_ivp(
            lambda t, y, b=begin: slope(min(max(t, b + 1e-9), b + 1e9 if b else JUMP_S - 1e-9), y),
            (begin, end), state, t_eval=at, rtol=1e-10, atol=1e-10,
        )  # fmt: skip
        expected.append(inside.y.T)
        state = inside.y[:, -1]
    # Both solve one linear system, exactly and to 1e-10 a step; the air itself is given and not compared.
    assert np.concatenate(found)[:, 1:] == pytest.approx(np.concatenate(expected)[:, 1:], abs=1e-6)
    assert np.concatenate(found)[JUMP_S - 1, AIR] == 35.0
    assert np.concatenate(found)[-1, AIR] == -20.0
