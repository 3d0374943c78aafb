"""The third witness: numbers worked by hand, from the conventions alone, against the whole forward path."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

from procedures.bench.errors import DeviceFault
from procedures.core.recording import Station
from procedures.core.table_angles import TableAngles
from simulators.imu.counter import Counter
from simulators.imu.sensor import launch_coefficients
from simulators.world import WorldConfig, build, launch_truth

G = 9.8
NORTH = 7.292115e-5 * 0.8660254037844386  # Ω cos 30°
UP = 7.292115e-5 * 0.5  # Ω sin 30°

# Worked with the right hand, at azimuth 0 unless named: x north, y up, z east at zero angles.
WITNESS = [
    # angles, azimuth, specific force [x, y, z], Earth rate [x, y, z]
    (TableAngles(), 0, (0, G, 0), (NORTH, UP, 0)),
    (TableAngles(inner_deg=90), 0, (0, 0, -G), (NORTH, 0, -UP)),  # y to the east, z down
    (TableAngles(inner_deg=-90), 0, (0, 0, G), (NORTH, 0, UP)),  # y to the west, z up
    (TableAngles(inner_deg=180), 0, (0, -G, 0), (NORTH, -UP, 0)),
    (TableAngles(middle_deg=90), 0, (G, 0, 0), (UP, -NORTH, 0)),  # x up, y south
    (TableAngles(middle_deg=-90), 0, (-G, 0, 0), (-UP, NORTH, 0)),  # x down, y north
    (TableAngles(outer_deg=90), 0, (0, G, 0), (0, UP, NORTH)),  # about up: x to the west, z to the north
    (TableAngles(), 90, (0, G, 0), (0, UP, -NORTH)),  # x to the east, z to the south
    (TableAngles(middle_deg=90, inner_deg=90), 0, (G, 0, 0), (UP, 0, NORTH)),  # x up, then y east, z north
    (TableAngles(outer_deg=90, middle_deg=90), 0, (G, 0, 0), (UP, 0, NORTH)),  # x up, y east, z north
]


@pytest.mark.parametrize(("angles", "azimuth", "force", "rate"), WITNESS)
def test_a_unit_at_rest_reads_what_the_right_hand_says(
    angles: TableAngles,
    azimuth: float,
    force: object,
    rate: object,
    quiet_config: Callable[..., WorldConfig],
    record,
    means,
) -> None:
    bench = build(quiet_config(azimuth))
    [raw] = record(bench, [Station(0, "", angles, None, 0.0, 4.0)])
    got = means(bench, raw)
    # A pulse over 4 s is 8.7e-10 rad/s and 8.7e-9 m/s²; the servo rests within 0.001″ (5e-8 m/s²).
    np.testing.assert_allclose(got[:3], rate, rtol=0, atol=1e-9)
    np.testing.assert_allclose(got[3:], force, rtol=0, atol=8e-8)


def test_an_off_diagonal_term_couples_the_column_s_axis_into_the_row_s_channel(quiet_config, record, means) -> None:
    matrix = ((1.0, 0.01, 0.0), (0.0, 0.9, 0.0), (0.0, -0.02, 1.0))
    config = quiet_config()
    triads = {n: replace(config.unit.triad(n), matrix=matrix) for n in ("gyro", "accelerometer")}
    bench = build(replace(config, unit=replace(config.unit, **triads)))
    [raw] = record(bench, [Station(0, "", TableAngles(), None, 0.0, 4.0)])
    got = means(bench, raw)
    np.testing.assert_allclose(got[:3], [NORTH + 0.01 * UP, 0.9 * UP, -0.02 * UP], rtol=0, atol=1e-9)
    np.testing.assert_allclose(got[3:], [0.098, 8.82, -0.196], rtol=0, atol=8e-8)


def test_bias_asymmetry_and_quadratic_term_by_hand(quiet_config, record, means) -> None:
    config = quiet_config()
    accelerometer = replace(
        config.unit.accelerometer,
        bias=(0.1, 0.2, -0.3),
        scale_factor_asymmetry_ppm=(0.0, 200.0, 0.0),
        scale_factor_nonlinearity_ppm=(0.0, 50.0, 0.0),
        nonlinearity_reference=9.8,
    )
    bench = build(replace(config, unit=replace(config.unit, accelerometer=accelerometer)))
    up_and_down = [
        Station(0, "", TableAngles(), None, 0.0, 4.0),
        Station(1, "", TableAngles(0, 0, 180), None, 0.0, 4.0),
    ]
    up, down = (means(bench, raw) for raw in record(bench, up_and_down))
    # Both terms are even: +9.8·(100 + 50)·1e-6 = +0.00147 whichever way y points.
    np.testing.assert_allclose(up[3:], [0.1, 0.2 + 9.8 + 0.00147, -0.3], rtol=0, atol=8e-8)
    np.testing.assert_allclose(down[3:], [0.1, 0.2 - 9.8 + 0.00147, -0.3], rtol=0, atol=8e-8)


def test_counts_are_the_floor_of_a_phase_that_is_carried() -> None:
    counter = Counter((0.5, 1.0, 2.0), [0, 1 << 31, 0])  # y begins half a pulse up
    counts = counter.count(np.array([[0.3, 0.3, 0.3], [0.5, 0.5, -1.0], [-0.5, 0.0, 0.5]]))
    # x: 0.6, 1.2, 1.8 pulses; y: 1.0, 1.5, 0.5; z: −0.25, −0.25, 0.
    np.testing.assert_array_equal(counts, [[0, 1, 0], [1, 0, -1], [-1, 0, 1]])


def test_a_counter_forgets_nothing_over_many_samples() -> None:
    counter = Counter((1.0, 1.0, 1.0), [0, 0, 0])
    increments = np.array([[0.25], [1.0 / 3.0], [-7.125]])
    total = sum(counter.count(np.repeat(increments, n, axis=1)).sum(axis=1) for n in (1, 999, 64000, 5000))
    np.testing.assert_array_equal(total, np.floor(70000 * increments[:, 0]))


def test_a_sample_too_large_for_the_counter_is_a_fault() -> None:
    with pytest.raises(DeviceFault, match="overflows"):
        Counter((1e-9, 1.0, 1.0), [0, 0, 0]).count(np.ones((3, 1)))


def test_launches_differ_by_the_run_to_run_spread() -> None:
    truth = replace(WorldConfig().unit.gyro, bias_run_to_run_sd=1e-8, scale_factor_run_to_run_sd_ppm=10.0)
    draws = [launch_coefficients(truth, 7, launch, "gyro") for launch in range(1, 401)]
    bias = np.array([c.bias for c in draws]) - truth.bias
    scale = np.array([np.diag(c.matrix) for c in draws]) / np.diag(truth.matrix) - 1.0
    # 1200 draws: a standard deviation is known to 1/√2400 = 2 %; 4 sigma.
    assert np.std(bias) == pytest.approx(1e-8, rel=0.08)
    assert np.std(scale) == pytest.approx(1e-5, rel=0.08)
    rows = np.array([c.matrix for c in draws]) / truth.matrix
    np.testing.assert_allclose(rows, np.repeat(rows[:, :, :1], 3, axis=2), rtol=1e-12)  # a row scales as one


def test_the_truth_of_a_launch_is_known_before_it_runs(record) -> None:
    config = WorldConfig(seed=3)
    bench = build(config)
    record(bench, [])
    for triad, (bias, matrix) in launch_truth(config, 1).items():
        np.testing.assert_array_equal(bench.true_calibration()[triad][0], bias)
        np.testing.assert_array_equal(bench.imu.sensor(triad).coefficients.matrix, matrix)
