"""Check `… absent, p-value` of static launches: how often are rate random walk and ramp claimed of sound launches?

``python -m tests.validation.absence [--launches N]`` (``make validate``). Launches of the default unit, whose truth has
neither process (thesis tables 4.1, 4.2), six hours each at 5 Hz: six records a launch. Printed are the shares of
records whose p-value lies below some levels, beside the levels, and of launches of six channels that the check itself
fails, beside the stated chance. Exit code 1 where a share is more than its level allows, by the binomial distribution
at 0.1 %. A p-value may be too large for a process that cannot be negative: fewer alarms than stated are no fault.
"""

import argparse
import asyncio
import os
import sys
from typing import Any

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")  # before numpy: one thread

import numpy as np
from scipy.stats import binom

from procedures.catalog import static_run
from procedures.catalog.static_run import Params
from procedures.core.recording import MemoryRecording
from procedures.noise_limits import ABSENCE, SLOW
from procedures.procedure import Context
from simulators.truth import default_bench, default_unit
from simulators.world import WorldConfig, build
from tests.kit.procedures import recorded as as_recording
from tests.kit.procedures import simulated_context

LEVELS = (0.2, 0.05, 0.01, 0.001)
CHANCE = 1e-3
"""Chance that one printed share fails though its level is kept."""
DURATION_S, RATE_HZ = 21_600.0, 5.0


def most(count: int, level: float) -> int:
    """Most alarms of so many at a level that chance explains with `CHANCE`."""
    return int(binom.isf(CHANCE, count, level))


async def recorded(params: Params, seed: int) -> list[MemoryRecording]:
    """Recordings of a static run on the simulated bench."""
    devices, found = build(WorldConfig(default_unit(), default_bench(), seed, RATE_HZ)), list[MemoryRecording]()
    async for stream in static_run.acquire(devices, static_run.schedule(params)):
        raw = np.concatenate([block async for block in stream.blocks])
        found.append(as_recording(stream, raw, len(found), "SIM-0001"))
    await devices.make_safe()
    return found


def launch(seed: int, context: Context) -> tuple[dict[str, list[float]], bool]:
    """p-values of the slow processes in each channel of one launch, by process; whether the check fails it."""
    params = static_run.resolve(
        Params.model_validate({"duration_s": DURATION_S, "sample_rate_hz": RATE_HZ, "launches": 1}), context
    )
    result: Any = static_run.analyse(asyncio.run(recorded(params, seed)), params, context)
    found: dict[str, list[float]] = {process: [] for process in SLOW}
    for channel in result.launches[0].channels:
        for process in SLOW:
            p_value = channel.coefficient(process).likelihood.p_value
            found[process].append(1.0 if p_value is None else p_value)
    return found, any(not c.passed for c in result.checks if c.limit.source == ABSENCE)


def main() -> int:
    """All launches, with a running line each tenth."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--launches", type=int, default=100)
    options = parser.parse_args()
    context, p_values, refused = simulated_context(), {process: list[float]() for process in SLOW}, 0
    for seed in range(options.launches):
        found, failed = launch(seed, context)
        refused += failed
        for process in SLOW:
            p_values[process] += found[process]
        if seed % 10 == 9 or seed + 1 == options.launches:
            told = {k: [sum(p < level for p in v) for level in LEVELS] for k, v in p_values.items()}
            print(f"  {seed + 1} launches, alarms at {LEVELS}: {told}, refused {refused}", flush=True)
    held = True
    for process, values in p_values.items():
        for level in LEVELS:
            alarms, allowed = sum(p < level for p in values), most(len(values), level)
            held &= alarms <= allowed
            share = alarms / len(values)
            print(f"{process} at {level:g}: {alarms} of {len(values)} records, {share:.4f} (at most {allowed})")
    stated = Params.model_validate({}).noise_limits.absence_level or 0.0
    allowed = most(options.launches, stated)
    held &= refused <= allowed
    print(f"check of both in six channels, stated {stated:g}: {refused} of {options.launches} launches (≤ {allowed})")
    print("as stated" if held else "NOT as stated")
    return 0 if held else 1


if __name__ == "__main__":
    sys.exit(main())
