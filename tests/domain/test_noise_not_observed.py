"""Processes that no launch shows: their weight in a unit's record, and how they are told from a finding."""

import math

import pytest

from procedures.analysis.launch.results import Reading
from procedures.analysis.launch.summary import effective
from procedures.analysis.thermal.cycle.checks import CycleLimits, _noise
from procedures.analysis.thermal.cycle.results import GyroNoise
from procedures.core.noise import NoiseCoefficients
from procedures.core.unit import TriadRecord
from procedures.core.units import DEG_PER_SQRT_HOUR


def absent(limit: float) -> Reading:
    return Reading(None, upper_limit=limit)


def test_an_unseen_process_has_the_mean_square_of_a_rectangular_distribution():
    """∫₀ᵃ x² dx/a = a²/3 (JCGM 100:2008, 4.3.7)."""
    assert effective([absent(3.0)]) == pytest.approx(math.sqrt(3.0))
    assert effective([absent(3.0), absent(6.0)]) == pytest.approx(math.sqrt((3.0 + 12.0) / 2.0))


def test_a_seen_process_keeps_its_value_and_is_joined_with_the_launches_that_hide_it():
    assert effective([Reading(2.0, 0.1), Reading(2.0, 0.1)]) == pytest.approx(2.0)
    assert effective([Reading(2.0, 0.1), absent(3.0)]) == pytest.approx(math.sqrt((4.0 + 3.0) / 2.0))


def test_a_launch_without_a_limit_says_nothing():
    assert effective([absent(math.inf), Reading(None)]) == 0.0
    assert effective([absent(math.inf), absent(3.0)]) == pytest.approx(math.sqrt(3.0))


def test_a_record_tells_what_was_found_from_what_is_only_bounded():
    noise = NoiseCoefficients(1.0, 2.0, 3.0, 4.0, 5.0)
    record = TriadRecord((noise,) * 3, not_observed=(("bias_instability", "rate_ramp"), (), ("random_walk",)))
    x, y, z = record.observed_noise
    assert (x.random_walk, x.bias_instability, x.rate_random_walk, x.rate_ramp) == (2.0, 0.0, 4.0, 0.0)
    assert y == noise
    assert z.random_walk == 0.0


def test_gyros_that_no_run_of_a_cycle_bounds_are_inconclusive():
    """The bound of one of two runs counts for the walk; the flicker, which neither bounds, has no value."""
    limits = CycleLimits(1.0, 1.0, 1.0, 0.003, 0.015, 0.01)
    nothing = (None, None, None)
    open_run, bounded = (
        GyroNoise(n, "x", *nothing, nothing, (1.0, w, None), None) for n, w in (("a", None), ("b", 1e-9))
    )
    walk, flicker = (_noise("gyro_x", [open_run, bounded], process, limits) for process in (1, 2))
    assert walk.passed
    assert walk.value == pytest.approx(1e-9 / DEG_PER_SQRT_HOUR)
    assert (flicker.value, flicker.inconclusive) == (None, True)
