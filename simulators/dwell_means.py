"""Station means of a whole run without samples, in milliseconds, for Monte Carlo over populations of units.

Truths, random numbers and moves are those of `simulators.world`, whose samples they replace.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from procedures.core import units
from procedures.core.recording import Station
from procedures.core.table_angles import TableAngles
from simulators.imu.sensor import station_means
from simulators.truth import Array
from simulators.turntable.device import SETTLE_S, pointing_error_rad
from simulators.turntable.kinematics import at_rest, attitude
from simulators.turntable.profile import move_ticks
from simulators.world import WorldConfig


@dataclass(frozen=True)
class DwellMeans:
    """Station means made without samples, each (n, 3) in the unit's axes: nominal outputs, and the true inputs."""

    gyro: Array
    """Nominal gyro outputs [rad/s]."""
    accelerometer: Array
    """Nominal accelerometer outputs [m/s²]."""
    rate_b: Array
    """True angular rate [rad/s]."""
    specific_force_b: Array
    """True specific force [m/s²]."""


def true_inputs(
    config: WorldConfig, angles: Sequence[TableAngles], moves: Sequence[int] | None = None
) -> tuple[Array, Array]:
    """True angular rate and specific force at commanded angles, each (n, 3), pointing errors of the moves included.

    Pure numpy. `moves`: number of the move to each of the angles since the bench was opened; None: 1, 2, …
    """
    table = config.bench.table
    numbers = range(1, len(angles) + 1) if moves is None else moves
    errors = np.array([pointing_error_rad(table, config.seed, move) for move in numbers]).reshape(-1, 3)
    axes = _axes_rad(angles) + errors
    return at_rest(attitude(axes, table, config.bench.description.site.azimuth_deg), config.bench.site)


def _axes_rad(angles: Sequence[TableAngles]) -> Array:
    return units.DEG * np.array([(a.outer_deg, a.middle_deg, a.inner_deg) for a in angles]).reshape(-1, 3)


def dwell_means(config: WorldConfig, stations: Sequence[Station], launch: int = 1) -> DwellMeans:
    """Compute the means of the stations' recordings, in milliseconds of time, for Monte Carlo (`tests.validation`).

    The unit is switched on with the table at zero and the stations follow as in a procedure: move, settle, record. See
    `simulators.imu.sensor.station_means` for what is equal to a full run and what only has the same distribution. Start
    times differ from those of a full run by what the servo needs to settle beyond half a second. Raises `ValueError`
    for a station whose recording holds no sample.
    """
    angles: list[TableAngles] = []
    moves: list[int] = []
    ticks: list[tuple[int, int]] = []
    now, move, here, rate = 0, 0, TableAngles(), config.rate_hz
    description = config.bench.description
    limits = (description.outer, description.middle, description.inner)
    for station in stations:
        if round(station.record_s * rate) < 1:
            raise ValueError(f"station {station.label!r}: record_s = {station.record_s!r} holds no sample")
        if station.angles is not None:
            distance_rad = (_axes_rad([station.angles]) - _axes_rad([here]))[0]
            now += move_ticks(distance_rad / units.DEG, limits, rate) + round(SETTLE_S * rate)
            move, here = move + 1, station.angles
        now += round(station.settle_s * rate)
        ticks.append((now, now + round(station.record_s * rate)))
        now = ticks[-1][1]
        angles.append(here)
        moves.append(move)
    rate_b, force_b = true_inputs(config, angles, moves)
    spans = np.array(ticks, dtype=np.float64).reshape(-1, 2)
    means = {
        name: station_means(config.unit.triad(name), rate, (config.seed, launch, name), spans, v)
        for name, v in (("gyro", rate_b), ("accelerometer", force_b))
    }
    return DwellMeans(means["gyro"], means["accelerometer"], rate_b, force_b)
