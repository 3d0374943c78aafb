"""Procedures of the thesis over TCP against served simulators, and in process: do their results agree statistically?

`python -m tests.validation.wires_campaign [--factor 20] [--seed 3]`. Drivers, bytes and pace of the wires are real, the
world behind them is that of the same seed. After a motion no count can be the same (`docs/devices.md`), so each figure
over wires is held against the one in process: their difference over √2 times the claimed standard uncertainty. What
both share (the launch's coefficients, the table's right angles) only makes it smaller, so that largeness alone is
judged: exit code 1 where a difference, or the sum of squares, is beyond what chance allows once in a thousand.
"""

import argparse
import asyncio
import os
import sys
import tempfile
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")  # before numpy: one thread

import numpy as np
from rich.console import Console
from rich.table import Table
from scipy.stats import chi2, norm

from bench_service.wall_clock import monotonic_s
from procedures.bench import Bench, BenchDescription, BenchNeeds
from procedures.catalog import discover
from procedures.core.recording import MemoryRecording, RecordingInfo, Station
from procedures.procedure import Context
from simulators.served.pace import MADE_UP_S
from simulators.truth import declared_unit, default_unit
from simulators.world import WorldConfig, build
from tests.conformance.served import served
from tests.kit.wired_bench import LANGUAGES, wired_driver

Figures = dict[str, tuple[float, float]]
"""Estimate and standard uncertainty by name."""
PARAMETERS: dict[str, dict[str, Any]] = {
    "static_run": {"launches": 2, "duration_s": 600.0, "off_time_s": 10.0},
    "calibration_12_orientations": {"dwell_s": 20.0},
    "verification_9_orientations": {"dwell_s": 20.0},
}


async def acquired(bench: Bench, procedure: Any, stations: Sequence[Station]) -> list[MemoryRecording]:
    """Recordings of a procedure's stations, held in memory; the bench is safe afterwards."""
    made: list[MemoryRecording] = []
    async for stream in procedure.acquire(bench, stations):
        raw = np.concatenate([block async for block in stream.blocks])
        info = RecordingInfo(
            *(f"{procedure.name} {len(made)}", "GL017", stream.channels, stream.rate_hz, len(raw), stream.start_s),
            station=stream.station,
            launched_s=stream.launched_s,
        )
        made.append(MemoryRecording(info, raw))
    await bench.make_safe()
    return made


def _results(open_bench: Any, description: BenchDescription, told: Any) -> dict[str, Any]:
    """Results of the procedures, each with a bench; the verification has the calibration before it."""
    context = Context(replace(declared_unit(default_unit()), serial="GL017"), description)
    found: dict[str, Any] = {}
    for name, given in PARAMETERS.items():
        procedure = discover()[name]
        params = procedure.resolve(procedure.params.model_validate(given), context)
        begun_s, bench = monotonic_s(), open_bench()
        try:
            recordings = asyncio.run(acquired(bench, procedure, procedure.schedule(params)))
        finally:
            bench.close()
        found[name] = procedure.analyse(recordings, params, context)
        calibrations = procedure.calibrations(found[name])
        if calibrations:
            unit = replace(context.unit, calibrations=calibrations, calibration_ids=("c",) * len(calibrations))
            context = replace(context, unit=unit)
        told(f"{name}: {monotonic_s() - begun_s:.0f} s, {sum(len(r.raw) for r in recordings)} samples")
    return found


def figures(results: dict[str, Any]) -> Figures:
    """Estimates with their uncertainties: noise of each launch, coefficients, magnitudes after correction."""
    found: Figures = {}
    for number, launch in enumerate(results["static_run"].launches):
        for channel in launch.channels:
            for c in channel.coefficients:
                reading = c.likelihood
                if reading.value is not None and reading.standard_uncertainty:
                    name = f"launch {number + 1}, {channel.channel}, {c.process}"
                    found[name] = reading.value, reading.standard_uncertainty
    for triad in results["calibration_12_orientations"].triads:
        found |= {str(c.name): (c.estimate, c.standard_uncertainty) for c in triad.coefficients}
    for triad in results["verification_9_orientations"].triads:
        m = triad.magnitudes
        for label, error, sd in zip(m.labels, m.errors, m.expected_sd, strict=True):
            found[f"|{m.triad}| at {label}"] = error, sd
    return found


def compared(wired: Figures, inside: Figures, console: Console) -> list[str]:
    """Print each kind of figure; a sentence for what is too far apart."""
    wrong = [f"{name} is told over wires or in process alone" for name in sorted(set(wired) ^ set(inside))]
    names = [name for name in wired if name in inside]
    z = np.array([(wired[n][0] - inside[n][0]) / np.hypot(wired[n][1], inside[n][1]) for n in names])
    largest = float(norm.isf(0.5e-3 / len(names) / 2.0))
    table = Table(title=f"over wires less in process, over its standard deviation: {len(names)} figures")
    for heading in ("figures", "number", "rms", "largest"):
        table.add_column(heading, justify="right")
    kinds = ("launch", "gyro.", "accelerometer.", "|gyro|", "|accelerometer|")
    for kind in kinds:
        own = z[[name.startswith(kind) for name in names]]
        if len(own):
            table.add_row(kind, str(len(own)), f"{np.sqrt(np.mean(own**2)):.2f}", f"{own[np.argmax(np.abs(own))]:+.2f}")
    console.print(table)
    most = float(chi2.isf(0.5e-3, len(z)))
    console.print(f"sum of squares {z @ z:.1f}, at most {most:.1f}; largest allowed {largest:.2f}")
    wrong += [f"{n}: {v:+.2f} standard deviations" for n, v in zip(names, z, strict=True) if abs(v) > largest]
    return wrong + ([f"the sum of squares is {z @ z:.1f}"] if z @ z > most else [])


def _over_wires(factor: float, seed: int, told: Any) -> tuple[dict[str, Any], BenchDescription]:
    with (
        tempfile.TemporaryDirectory(prefix="wires-") as name,
        served(LANGUAGES, factor=factor, world=WorldConfig(seed=seed), made_up_s=MADE_UP_S) as behind,
    ):
        driver = wired_driver(Path(name), behind, factor, after_demand_s=0.02)
        results = _results(lambda: driver.open("GL017", None, None, BenchNeeds()), driver.description, told)
        told(f"{behind.bench.pace.behind_s:.0f} s of bench time given up")
        return results, driver.description


def main() -> int:
    """Both campaigns, side by side."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--factor", type=float, default=20.0, help="bench seconds in a real second, over wires")
    parser.add_argument("--seed", type=int, default=3)
    given = parser.parse_args()
    console = Console(width=110)
    wired, description = _over_wires(given.factor, given.seed, lambda words: console.print(f"over wires: {words}"))
    world = build(WorldConfig(seed=given.seed))  # one world as over wires: the launches have the same numbers
    inside = _results(lambda: world, description, lambda words: console.print(f"in process: {words}"))
    wrong = compared(figures(wired), figures(inside), console)
    console.print("\n".join(wrong) if wrong else "[green]they agree[/green]")
    return 1 if wrong else 0


if __name__ == "__main__":
    sys.exit(main())
