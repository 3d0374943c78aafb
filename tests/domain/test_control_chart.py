"""The individuals chart against a published example, the run rules against their published false-alarm rate."""

from math import pi, sqrt

import numpy as np
import pytest

from procedures.analysis.control_chart import D2, RULES, ControlLimits, control_limits, signals
from procedures.core.errors import BadParameter
from procedures.core.units import converted

FLOW_RATES = (49.6, 47.6, 49.9, 51.3, 47.8, 51.2, 52.6, 52.4, 53.6, 52.1)
"""NIST/SEMATECH e-Handbook of Statistical Methods, 6.3.2.2: flow rates of ten batches."""
UNIT = ControlLimits(0.0, 1.0, -3.0, 3.0, D2, 3.267 * D2, 100)


def test_the_handbooks_example() -> None:
    found = control_limits(FLOW_RATES)
    assert found.centre == pytest.approx(50.81, abs=5e-3)
    assert found.mean_moving_range == pytest.approx(1.8778, abs=5e-5)
    assert found.upper == pytest.approx(55.8041, abs=5e-5)
    assert found.lower == pytest.approx(45.8159, abs=5e-5)
    assert [s.rule for s in signals(FLOW_RATES, found) if s.rule == RULES[0].name] == []


def test_the_range_of_two_gaussian_values() -> None:
    assert pytest.approx(2.0 / sqrt(pi), abs=5e-4) == D2


def test_a_slow_drift_does_not_widen_its_own_limits() -> None:
    rng = np.random.Generator(np.random.PCG64(3))
    noise = rng.standard_normal(200)
    drifting = noise + 0.05 * np.arange(200)
    still, moved = control_limits(noise.tolist()), control_limits(drifting.tolist())
    assert moved.sigma == pytest.approx(still.sigma, rel=0.05)
    assert float(np.std(drifting)) > 2.5 * still.sigma
    assert signals(drifting.tolist(), moved)


def test_a_constant_is_in_control_and_the_least_step_is_seen() -> None:
    rng = np.random.Generator(np.random.PCG64(5))
    for value in rng.standard_normal(200) * 10.0 ** rng.integers(-12, 12, 200):
        for count in (9, 20, 100):
            constant = [float(value)] * count
            limits = control_limits(constant)
            assert (limits.centre, limits.sigma) == (value, 0.0)
            assert signals(constant, limits) == ()
            assert signals([*constant, float(value) * (1.0 + 1e-12)], limits)[0].index == count


@pytest.mark.parametrize(
    ("values", "rule", "index"),
    [
        ((0.1, 3.01), 0, 1),
        ((0.1, -3.01), 0, 1),
        ((2.1, 0.0, 2.1), 1, 2),
        ((1.1, 1.1, -0.1, 1.1, 1.1), 2, 4),
        ((0.1,) * 8, 3, 7),
        ((-0.1,) * 8, 3, 7),
    ],
)
def test_each_rule_where_it_is_broken(values: tuple[float, ...], rule: int, index: int) -> None:
    assert [(s.index, s.rule, s.side) for s in signals(values, UNIT)] == [
        (index, RULES[rule].name, 1 if values[-1] > 0 else -1)
    ]


@pytest.mark.parametrize(
    "values",
    [
        (3.0, -3.0),
        (2.1, 0.0, -2.1),
        (2.1, 0.0, 0.0, 2.1),
        (1.1, 1.1, -1.1, 1.1, -0.1, 0.1),
        (0.1,) * 7,
        (0.1,) * 4 + (0.0,) + (0.1,) * 4,
        (2.1, 2.0, 0.0),
    ],
)
def test_what_breaks_no_rule(values: tuple[float, ...]) -> None:
    assert signals(values, UNIT) == ()


def test_the_rules_cry_wolf_as_often_as_published() -> None:
    """Average run length of a process that did not change: 91.75 for the four rules (Champ and Woodall 1987)."""
    rng = np.random.Generator(np.random.PCG64(11))
    lengths = []
    for _ in range(150):
        values = rng.standard_normal(900)
        found = signals(values.tolist(), UNIT)
        assert found
        lengths.append(found[0].index + 1)
    error = float(np.std(lengths)) / sqrt(len(lengths))
    assert np.mean(lengths) == pytest.approx(91.75, abs=4.0 * error)


def test_values_that_never_changed_have_limits_of_no_width() -> None:
    found = control_limits([5.0] * 10)
    assert (found.lower, found.upper) == (5.0, 5.0)
    assert signals([5.0] * 10, found) == ()
    assert [s.index for s in signals([5.0] * 10 + [5.1], found)] == [10] * 1


@pytest.mark.parametrize("values", [(), (1.0,), (1.0, float("nan")), (1.0, float("inf"), 2.0)])
def test_what_is_no_chart_is_refused(values: tuple[float, ...]) -> None:
    with pytest.raises(BadParameter, match="values"):
        control_limits(values)


def test_units_of_one_kind_are_converted_and_others_refused() -> None:
    assert converted(15.041067, "deg/h", "rad/s") == pytest.approx(7.292115e-5, rel=1e-7)
    assert converted(1.0, "1", "ppm") == pytest.approx(1e6)
    assert converted(1.0, "µg", "m/s^2") == pytest.approx(9.80665e-6)
    assert converted(2.5, "bananas", "bananas") == 2.5
    with pytest.raises(ValueError, match=r"rad/s, deg/s, deg/h can be requested, ppm cannot"):
        converted(1.0, "deg/h", "ppm")
