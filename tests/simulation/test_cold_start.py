"""The calibration of thermometers on the simulated world, from the procedure's own steps to its numbers."""

import asyncio
from dataclasses import replace

import numpy as np
import pytest

from procedures.bench.errors import SoakNotReached
from procedures.catalog.thermometer_calibration import PROCEDURE, Params
from procedures.core.recording import MemoryRecording, RecordingInfo
from procedures.procedure import Context
from simulators.truth import declared_unit, default_bench, default_unit
from simulators.world import WorldConfig, build
from tests.validation.thermometer_rig import found_of, true_lines

BENCH, UNIT = default_bench(), default_unit()
CONTEXT = Context(declared_unit(UNIT), BENCH.description)
RATE_HZ = 10.0


def run(params: Params, truth=UNIT) -> list[MemoryRecording]:
    async def go() -> list[MemoryRecording]:
        bench, found = build(WorldConfig(truth, BENCH, 3, RATE_HZ, thermal=True)), []
        async for stream in PROCEDURE.acquire(bench, PROCEDURE.schedule(params)):
            raw = np.concatenate([block async for block in stream.blocks])
            info = RecordingInfo(f"r{len(found)}", "u", stream.channels, stream.rate_hz, len(raw), stream.start_s)
            # Switched on in the moment that the recording begins.
            found.append(MemoryRecording(replace(info, station=stream.station, launched_s=stream.start_s), raw))
        await bench.make_safe()
        return found

    return asyncio.run(go())


def test_the_worlds_thermometers_are_found_through_the_chamber():
    """Offsets carry the chamber's 0.6 °C at the unit's place, declared as ±1 °C; four sigma for ten numbers."""
    sensors = tuple(replace(t, slope=0.005 * (i - 2)) for i, t in enumerate(UNIT.thermal.thermometers))
    truth = replace(UNIT, thermal=replace(UNIT.thermal, thermometers=sensors))
    params = PROCEDURE.resolve(Params(temperatures_c=(-20.0, 20.0, 60.0, 20.0), sample_rate_hz=RATE_HZ), CONTEXT)
    result = PROCEDURE.analyse(run(params, truth), params, CONTEXT)
    error = found_of(result.thermometers) - true_lines(truth.thermal)
    claimed = np.sqrt(np.diag(np.array(result.thermometers.correction.covariance)))
    assert np.all(np.abs(error) < 4.0 * claimed), error / claimed
    shared = error[::2] - error[::2].mean()
    assert np.abs(shared).max() < 0.1, "the chamber's part is common: what is left is noise of some 0.03 °C"


def test_a_chamber_that_does_not_arrive_ends_the_job_and_names_the_soak():
    params = PROCEDURE.resolve(Params(temperatures_c=(60.0, 20.0, -20.0), soak_s=120.0, sample_rate_hz=10.0), CONTEXT)
    with pytest.raises(SoakNotReached, match="soak_s"):
        run(params)
