"""Cold starts without the service: the unit's network of heat from the truth, soaked off, then switched on.

The chamber's errors are drawn as its declaration has them: one for the place, another one at each soak.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from procedures.analysis.thermal.profile_progress import SENSORS
from procedures.analysis.thermal.thermometers import Calibrated, SoakSettings, calibrate, read_soaks
from procedures.core.recording import Channel, MemoryRecording, Quantity, RecordingInfo, Station
from simulators.chamber.network import CASE, HEATER, POWER, Step, rates
from simulators.chamber.thermometers import Thermometers
from simulators.truth import Array, keyed_generator
from simulators.truth.thermal import NODES, REFERENCE_C, ChamberTruth, UnitThermalTruth, random_thermal_truth

SETTINGS = SoakSettings(0.3, 0.05, 5.0, 0.5, 21_600.0, 2200.0)
TARGETS = (-40.0, -10.0, 20.0, 60.0, 20.0, -10.0)
CHANNELS = tuple(Channel(name, Quantity.TEMPERATURE, "degC") for name in (*SENSORS, "chamber_air"))
SECONDS = 120


@dataclass(frozen=True)
class Compared:
    """One unit: errors of offsets and slopes with the claimed covariance."""

    error: Array
    """Offset and slope of each sensor less the truth, (10,)."""
    covariance: Array
    """Claimed, (10, 10)."""
    found: Calibrated


def drawn(seed: int) -> UnitThermalTruth:
    """A drawn unit whose sensors have slopes too, and lags that differ from the data sheet's by half a second."""
    truth, rng = random_thermal_truth(seed), keyed_generator(seed, "thermometer slopes")
    sensors = tuple(
        replace(t, slope=0.004 * float(rng.standard_normal()), lag_s=5.0 + 0.5 * float(rng.uniform(-1.0, 1.0)))
        for t in truth.thermometers
    )
    return replace(truth, thermometers=sensors)


def cold_start(truth: UnitThermalTruth, air_c: float, seed: int, seconds: int = SECONDS) -> Array:
    """Readings (seconds, 5) [°C] after switching on a unit that was all at one temperature, the air staying there."""
    a, b = rates(ChamberTruth(), truth.network, False)
    a[0], b[0] = 0.0, 0.0  # the controller holds the air
    step = Step.of(a, b, 1.0).matrix
    state = np.zeros(len(NODES) + 5)
    state[: len(NODES)], state[POWER], state[HEATER] = air_c, 1.0, 0.0
    path = np.empty((seconds, len(NODES)))
    for k in range(seconds):
        state[: len(NODES)] = path[k] = step @ state
    assert path[-1, CASE] > air_c
    sensors = Thermometers(truth.thermometers, seed, air_c)
    steps = np.array([t.step_c for t in truth.thermometers])
    return sensors.read(0, path) * steps


def recordings(
    truth: UnitThermalTruth, seed: int, settings: SoakSettings = SETTINGS, targets: Sequence[float] = TARGETS
) -> list[MemoryRecording]:
    """Cold starts at the targets, the chamber wrong as its declaration says."""
    rng = keyed_generator(seed, "chamber's errors")
    place, found = settings.place_sd_c * rng.standard_normal(), []
    for k, target in enumerate(targets):
        own = settings.soak_sd_c * rng.standard_normal()
        readings = cold_start(truth, float(target + place + own), 1000 * seed + k)
        raw = np.column_stack([readings, np.full(len(readings), target)])
        station = Station(k, f"{target:g} °C", temperature_c=target, temperatures=True)
        info = RecordingInfo(f"r{k}", "u", CHANNELS, 1.0, len(raw), 100.0, station, launched_s=100.0)
        found.append(MemoryRecording(info, raw))
    return found


def compared(seed: int, settings: SoakSettings = SETTINGS) -> Compared:
    """One drawn unit, calibrated."""
    truth = drawn(seed)
    found = calibrate(read_soaks(recordings(truth, seed, settings), settings), settings)
    return Compared(found_of(found) - true_lines(truth), np.array(found.correction.covariance), found)


def found_of(found: Calibrated) -> Array:
    """Offset and slope of each sensor, (10,)."""
    return np.array([v for s in found.sensors for v in (s.offset_c, s.slope)])


def true_lines(truth: UnitThermalTruth) -> Array:
    """Offset and slope of each sensor by *reading*, about a reading of 20 °C, (10,).

    The sensor is wrong by ``o + s·(T − 20)``; of the reading r = T + that it is ``(o + s·(r − 20))/(1 + s)``.
    """
    assert SETTINGS.reference_c == REFERENCE_C
    return np.array([v / (1.0 + t.slope) for t in truth.thermometers for v in (t.offset_c, t.slope)])
