"""``python -m tests.validation.wires_thermal``: a thermal cycle over TCP, beside the same in process.

Three launches in the chamber with x, y and z up, legs of at least 20 min: the procedure runs unchanged over the wires
of a bench whose devices and person are served at a time factor. The service's own code drives it, from the bench file
on. Without ``--factor`` half the highest factor is taken at which the served world alone gives up hardly any time.

The same seed gives the same launches: their coefficients, their noise, the lean of each setting. The gyros, which do
not depend on temperature here, must count the same, sample by sample, over the whole of each launch. The chamber's
course is another, for each demand reaches it at another tick, and the accelerometers follow it. Compared are the
corrections with their covariances, the gyros' slopes, what the soaks are left with, and the durations. Exit code 1
where a sum of squares, or a single figure, is beyond what chance allows once in a thousand, or where time was given up.
"""

import argparse
import asyncio
import os
import sys
import tempfile
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")  # before numpy: one thread

import numpy as np
from rich.console import Console
from rich.table import Table
from scipy.stats import chi2, norm

from bench_service.wall_clock import monotonic_s, pause
from procedures.bench import Bench, BenchDescription, BenchNeeds
from procedures.catalog import discover
from procedures.core.recording import MemoryRecording
from procedures.procedure import Context
from simulators.served.at_once import at_once
from simulators.served.pace import MADE_UP_S
from simulators.truth import declared_unit, default_unit
from simulators.world import WorldConfig, build
from tests.conformance.served import Served, served
from tests.kit.thermal_plan import leg
from tests.kit.wired_bench import PERSON, THERMAL_LANGUAGES, wired_driver
from tests.validation.wires_campaign import acquired

Told = Callable[[str], None]
CYCLE = discover()["thermal_cycle"]
LANGUAGES = {**THERMAL_LANGUAGES, **PERSON}
TARGETS_C = (20.0, -20.0, 50.0, 20.0)
RAMP_C_MIN = 3.0
"""Largest ramp of the served bench's chamber by its bench file [K/min]."""
FACTORS = (1000.0, 500.0, 200.0, 100.0, 50.0, 20.0, 10.0)
TRIAL_S = 8.0
"""Real time for which a factor is tried [s]."""
GIVEN_UP = 1e-3
"""Share of bench time that may be given up."""
CHANCE = 1e-3
GYROS, FIRST = 3, 50
"""Number of the gyros' columns, and of samples by which a recording's place in the launch is found."""


@dataclass(frozen=True)
class Cycle:
    """Outcome of a cycle, and how it came about."""

    result: Any
    recordings: Sequence[MemoryRecording]
    took_s: float
    given_up_s: float = 0.0

    @property
    def bench_s(self) -> float:
        """Bench time from the first launch to the end of the last recording [s]."""
        first, last = self.recordings[0].info, self.recordings[-1].info
        return last.start_s + last.count / last.rate_hz - first.start_s


def plan() -> dict[str, Any]:
    """Parameters of the cycle."""
    legs = [leg(target) | {"ramp_c_min": RAMP_C_MIN} for target in TARGETS_C]
    return {"legs": legs, "soak": {"slope_c_min": 0.3}, "power_off_s": 1800.0}


def cycle(bench: Bench, description: BenchDescription) -> Cycle:
    """Run and analyse the cycle on a bench."""
    context = Context(replace(declared_unit(default_unit()), serial="GL017"), description)
    params = CYCLE.resolve(CYCLE.params.model_validate(plan()), context)
    begun_s = monotonic_s()
    recordings = asyncio.run(acquired(bench, CYCLE, CYCLE.schedule(params)))
    took_s = monotonic_s() - begun_s
    return Cycle(CYCLE.analyse(recordings, params, context), recordings, took_s)


def over_wires(factor: float, seed: int, rate_hz: float) -> tuple[Cycle, BenchDescription]:
    """Run the cycle by the service's drivers, at served devices."""
    world = WorldConfig(seed=seed, sample_rate_hz=rate_hz)
    with (
        tempfile.TemporaryDirectory(prefix="wires-") as name,
        served(LANGUAGES, thermal=True, factor=factor, world=world, made_up_s=MADE_UP_S) as behind,
    ):
        driver = wired_driver(Path(name), behind, factor, after_demand_s=0.02)
        bench, before_s = driver.open("GL017", None, None, BenchNeeds(temperatures=True)), behind.bench.pace.behind_s
        try:
            found = cycle(bench, driver.description)
        finally:
            bench.close()
        return replace(found, given_up_s=behind.bench.pace.behind_s - before_s), driver.description


def highest_factor(seed: int, rate_hz: float, told: Told) -> float:
    """Highest of `FACTORS` that this machine keeps while a listener takes the unit's frames. Raises `SystemExit`."""
    for factor in FACTORS:
        world = WorldConfig(seed=seed, sample_rate_hz=rate_hz)
        with served(LANGUAGES, thermal=True, factor=factor, world=world, made_up_s=MADE_UP_S) as behind:
            behind.do(_switched_on)
            pause(1.0)  # the launch of the unit takes long once
            share = _given_up(behind, factor)
        told(f"factor {factor:g}: {share:.2%} of bench time given up in {TRIAL_S:g} s")
        if share < 0.5 * GIVEN_UP:
            return 0.5 * factor  # the drivers need the other half of the machine
    raise SystemExit(f"this machine keeps no factor of {FACTORS[-1]:g} or more")


def _switched_on(bench: Any) -> None:
    at_once(bench.bench.supply.switch_on())


def _given_up(behind: Served, factor: float) -> float:
    begun_s, before_s = monotonic_s(), behind.bench.pace.behind_s
    pause(TRIAL_S)
    return (behind.bench.pace.behind_s - before_s) / (factor * (monotonic_s() - begun_s))


def compared(wired: Cycle, inside: Cycle, console: Console) -> list[str]:
    """Print both; a sentence for what is further apart than chance allows."""
    table = Table(title="over wires and in process", title_style="bold")
    for heading in ("figure", "over wires", "in process", "apart", "allowed"):
        table.add_column(heading, justify="right")
    wrong: list[str] = []

    def judged(name: str, one: str, other: str, apart: float, allowed: float) -> None:
        table.add_row(name, one, other, f"{apart:.2f}", f"{allowed:.2f}")
        if not apart <= allowed:
            wrong.append(f"{name}: {apart:.2f} where at most {allowed:.2f} is chance")

    a, b = wired.result.cycle, inside.result.cycle
    number = len(a.axes) + len(a.gyros)
    for axis, one, other in zip("xyz", a.axes, b.axes, strict=True):
        square, freedom = _square(one.correction, other.correction)
        first, second = (_words(fit.correction) for fit in (one, other))
        most = float(chi2.isf(CHANCE / number, freedom))
        judged(f"correction {axis}: χ² of {freedom}", first, second, square, most)
    for one, other in zip(a.gyros, b.gyros, strict=True):
        z = abs(one.slope_rad_s_c - other.slope_rad_s_c) / np.hypot(one.slope_sd_rad_s_c, other.slope_sd_rad_s_c)
        first, second = (f"{g.slope_rad_s_c:.2e} rad/s/°C" for g in (one, other))
        judged(f"gyro {one.axis} slope: z", first, second, float(z), float(norm.isf(CHANCE / number / 2.0)))
    for k, axis in enumerate("xyz"):
        worst = [1e6 * max(s.after_m_s2[k] for s in c.soaks) for c in (a, b)]
        table.add_row(f"worst 3σ of a soak, {axis} [µm/s²]", *(f"{w:.0f}" for w in worst), "", "")
    for one, other in zip(a.runs, b.runs, strict=True):
        table.add_row(f"duration, {one.name} [s]", f"{one.duration_s:.0f}", f"{other.duration_s:.0f}", "", "")
    table.add_row("verdict", str(wired.result.verdict.value), str(inside.result.verdict.value), "", "")
    console.print(table)
    if [len(r.legs) for r in a.runs] != [len(r.legs) for r in b.runs]:
        wrong.append("the runs have another number of legs")
    return wrong


def same_counts(wired: Cycle, inside: Cycle, console: Console) -> list[str]:
    """Print whether each run's gyros counted over wires what they count in process; what is wrong."""
    wrong: list[str] = []
    for one, other in zip(wired.recordings, inside.recordings, strict=True):
        label = "" if one.info.station is None else one.info.station.label
        over, within = (np.asarray(r.raw)[:, :GYROS] for r in (one, other))
        starts = np.flatnonzero((within[: len(within) - FIRST] == over[0]).all(axis=1))
        offsets = [k for k in starts.tolist() if np.array_equal(within[k : k + FIRST], over[:FIRST])]
        count = min(len(over), len(within) - offsets[0]) if offsets else 0
        same = count > 0 and np.array_equal(over[:count], within[offsets[0] : offsets[0] + count])
        words = f"the same in all {count} samples, begun {offsets[0]} later" if same else "not those in process"
        console.print(f"counts of the gyros, {label}: {words}")
        wrong += [] if same else [f"{label}: the gyros' counts are not those in process"]
    return wrong


def _words(correction: Any) -> str:
    return f"{correction.alpha[3] * 1e6:.2f} ppm/°C, {correction.beta[2] * 1e6:.1f} µm/s²/°C"


def _square(one: Any, other: Any) -> tuple[float, int]:
    """Squared distance of two corrections by the sum of their covariances, and its degrees of freedom."""
    difference = np.array([*one.alpha, *one.beta]) - np.array([*other.alpha, *other.beta])
    covariance = np.array(one.covariance) + np.array(other.covariance)
    size = np.sqrt(np.diag(covariance))
    used = size > 0.0
    scaled = covariance[np.ix_(used, used)] / np.outer(size[used], size[used])
    z = difference[used] / size[used]
    return float(z @ np.linalg.solve(scaled, z)), int(used.sum())


def main() -> int:
    """Both cycles, one after the other."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--factor", type=float, default=None, help="bench seconds in a real second; without: found")
    parser.add_argument("--seed", type=int, default=3)
    parser.add_argument("--rate-hz", type=float, default=20.0, help="sample rate of the unit")
    given = parser.parse_args()
    console = Console(width=130)
    console.print(f"load average {os.getloadavg()[0]:.1f}")
    factor = given.factor or highest_factor(given.seed, given.rate_hz, console.print)
    wired, description = over_wires(factor, given.seed, given.rate_hz)
    samples = sum(len(r.raw) for r in wired.recordings)
    console.print(
        f"over wires: factor {factor:g}, {wired.bench_s / 3600.0:.2f} h of bench time in {wired.took_s:.0f} s, "
        f"{samples} samples of {given.rate_hz:g} Hz, {wired.given_up_s:.1f} s of bench time given up"
    )
    world = WorldConfig(seed=given.seed, sample_rate_hz=given.rate_hz, thermal=True)
    inside = cycle(build(world), description)
    console.print(f"in process: {inside.bench_s / 3600.0:.2f} h of bench time in {inside.took_s:.0f} s")
    wrong = compared(wired, inside, console) + same_counts(wired, inside, console)
    if wired.given_up_s > GIVEN_UP * wired.bench_s:
        wrong.append(f"{wired.given_up_s:.1f} s of bench time were given up: take a lower factor")
    console.print("\n".join(wrong) if wrong else "[green]they agree[/green]")
    return 1 if wrong else 0


if __name__ == "__main__":
    sys.exit(main())
