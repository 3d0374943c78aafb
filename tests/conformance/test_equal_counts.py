"""The same seed over wires and in process: equal counts, sample by sample, where the unit goes through the same.

Over wires time is the wall's: a demand reaches the table at another tick each time, so a recording begins at another
tick of the launch, and a motion is at another place in it. What a launch is, its coefficients and its noise, depends on
the seed and on the tick alone. So a recording at rest over wires is a stretch of the launch in process, to the bit.
One that holds or follows a motion is not: each axis draws its pointing error at each demand, and the motion begins
elsewhere.
"""

import asyncio
from pathlib import Path
from typing import Any

import numpy as np

from procedures.bench import Bench, BenchNeeds
from simulators.world import WorldConfig, build
from tests.conformance.served import served
from tests.kit.wired_bench import LANGUAGES, wired_driver

FACTOR = 10.0
SEED = 77
BEFORE_S, RECORD_S, LAUNCH_S = 3.0, 4.0, 400.0
"""A busy machine may take long until it records; the launch in process is long enough to hold the recording."""


async def _recorded(bench: Bench, before_s: float, record_s: float) -> tuple[list[str], np.ndarray]:
    await bench.supply.switch_on()
    await bench.clock.sleep(before_s)
    stream = bench.imu.record(record_s)
    blocks: list[Any] = [block async for block in stream.blocks]
    return [channel.name for channel in stream.channels], np.concatenate(blocks)


def test_a_recording_over_wires_is_a_stretch_of_the_launch_in_process(tmp_path: Path) -> None:
    with served(LANGUAGES, factor=FACTOR, world=WorldConfig(seed=SEED)) as behind:
        wired = wired_driver(tmp_path, behind, FACTOR)
        bench = wired.open("GL017", None, None, BenchNeeds())
        try:
            names, over_wires = asyncio.run(_recorded(bench, BEFORE_S, RECORD_S))
            asyncio.run(bench.make_safe())
        finally:
            bench.close()
    for seed, same in ((SEED, True), (SEED + 1, False)):
        names_in, launch = asyncio.run(_recorded(build(WorldConfig(seed=seed)), 0.0, LAUNCH_S))
        assert names_in == names
        begins = np.flatnonzero((launch[: len(launch) - len(over_wires)] == over_wires[0]).all(axis=1))
        found = [k for k in begins.tolist() if np.array_equal(launch[k : k + len(over_wires)], over_wires)]
        assert len(found) == (1 if same else 0), f"seed {seed}"
        if same:
            assert found[0] >= int(0.5 * BEFORE_S * 400)
