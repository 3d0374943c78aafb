"""Recordings of thermal runs out of the validation's rig: outputs and thermometers as a procedure gets them."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from procedures.analysis.turns.plan import UPRIGHT
from procedures.core.imu_model import triad_calibration
from procedures.core.noise import NoiseCoefficients
from procedures.core.recording import ACCELEROMETER, GYRO, Channel, MemoryRecording, Quantity, RecordingInfo, Station
from procedures.core.site import Site
from procedures.core.temperature_profile import ProfileLeg, SoakCriterion, TemperatureProfile
from procedures.core.unit import TriadRecord, Unit
from simulators.chamber.behaviour import gyros
from simulators.truth import Array, keyed_generator
from simulators.truth.thermal import UnitThermalTruth
from tests.validation.thermal_population import GYRO_FLICKER, GYRO_RANDOM_WALK
from tests.validation.thermal_rig import BIAS, SCALE, Cycle, G, Leg, converter_bench, cycle, flicker

SENSORS = tuple(f"temperature_{name}" for name in ("case", "converter", "gyro_x", "gyro_y", "gyro_z"))
TEMPERATURES = (*SENSORS, "chamber_air", "chamber_set_point")
CHANNELS = (
    *(Channel(name, Quantity.ANGULAR_RATE, "rad/s") for name in GYRO),
    *(Channel(name, Quantity.SPECIFIC_FORCE, "m/s^2") for name in ACCELEROMETER),
    *(Channel(name, Quantity.TEMPERATURE, "degC") for name in TEMPERATURES),
)
SITE = Site(latitude_deg=50.0, gravity_m_s2=G)
ANYTHING_IS_A_SOAK = SoakCriterion(slope_c_min=100.0, window_s=60.0, air_within_c=100.0)
"""The rig's legs last as long as they are told to."""


def station(index: int, legs: Sequence[Leg]) -> Station:
    """Station of a run of the rig: each leg ends when its time is over."""
    made = tuple(ProfileLeg(g.target_c, g.ramp_c_min, 0.0, g.seconds + 60.0, g.seconds) for g in legs)
    profile = TemperatureProfile(made, ANYTHING_IS_A_SOAK)
    axis = "xyz"[index]
    return Station(index, f"{axis} up", UPRIGHT[axis], record_s=profile.longest_s, temperatures=True, profile=profile)


def set_points(legs: Sequence[Leg], start_c: float) -> Array:
    """The chamber's set point, one value a second."""
    parts, at = [], start_c
    for leg in legs:
        away = np.minimum(leg.ramp_c_min / 60.0 * np.arange(1, leg.seconds + 1), abs(leg.target_c - at))
        parts.append(at + np.sign(leg.target_c - at) * away)
        at = leg.target_c
    return np.concatenate(parts)


def recording(run: Cycle, truth: UnitThermalTruth, legs: Sequence[Leg], seed: int) -> MemoryRecording:
    """One run with gyros of the thesis's noise."""
    rng, count = keyed_generator(seed, "thermal samples", run.up), len(run.output)
    rates = gyros(truth.gyro, run.nodes_c) + GYRO_FLICKER * flicker(rng, count)
    rates += GYRO_RANDOM_WALK * rng.standard_normal((count, 3))
    raw = np.column_stack([rates, run.output, run.codes, run.nodes_c[:, 0], set_points(legs, 22.0)])
    info = RecordingInfo(f"run-{run.up}", "S-1", CHANNELS, 1.0, count, 0.0, station(run.up, legs), launched_s=0.0)
    return MemoryRecording(info, raw)


def recordings(truth: UnitThermalTruth, legs: Sequence[Leg], seed: int) -> list[MemoryRecording]:
    """Three runs, x, y and z up."""
    return [recording(cycle(truth, legs, up, 10 * seed + up), truth, legs, seed) for up in range(3)]


def unit_of(truth: UnitThermalTruth, seed: int) -> Unit:
    """The rig's unit: calibrated at the reference, its converter measured alone, its noise known."""
    noise = NoiseCoefficients(random_walk=GYRO_RANDOM_WALK, bias_instability=GYRO_FLICKER)
    matrix = np.column_stack([BIAS, np.diag(SCALE)])
    calibration = triad_calibration("accelerometer", "m/s^2", "m/s^2", matrix, 1e-14 * np.eye(12))
    known = Unit("S-1", 400.0, CHANNELS[:6], gyro=TriadRecord((noise, noise, noise)), calibrations=(calibration,))
    return replace(known, converter=converter_bench(truth, seed))
