"""``python -m tests.validation.wires_response``: `dynamic_response` over TCP, at a served world that keeps time or not.

The unit of the served world has no lag, so the delay that is found is that of the stamps (docs/devices.md: some 10 ms,
another in each recording). Three scenes, each by the service's drivers in real time:

* the world keeps time: the delay agrees with zero within its uncertainty and those 20 ms, or the clocks are said to
  have parted, where this machine is too slow;
* the world runs slower than the bench file states, by 2 %;
* the world stands still for 1.4 s now and then, of which it makes up for 1 s.

In the last two the analysis must refuse. Exit code 1 where a delay is told that the
unit does not have, or where one of the last two is not refused.
"""

import argparse
import asyncio
import os
import sys
import tempfile
import time
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")  # before numpy: one thread

from procedures.bench import BenchNeeds
from procedures.catalog import discover
from procedures.core.errors import UnfitRecording
from procedures.procedure import Context
from simulators.served.pace import MADE_UP_S
from simulators.truth import declared_unit, default_unit
from simulators.world import WorldConfig
from tests.conformance.served import Served, served
from tests.kit.wired_bench import LANGUAGES, wired_driver
from tests.validation.wires_campaign import acquired

RESPONSE = discover()["dynamic_response"]
STAMPS_S = 20e-3
"""Largest offset of a recording's stamp over wires (docs/devices.md): twice the time for which frames gather."""
SIGMAS = 4.0
REFUSED = "refused: "


def response(pace: float, stands: bool, seed: int, parameters: dict[str, Any]) -> str:
    """Run the procedure; the delays as a sentence, or that of the refusal. `pace`: of the world by the real clock."""
    with (
        tempfile.TemporaryDirectory(prefix="wires-") as name,
        served(LANGUAGES, factor=pace, world=WorldConfig(seed=seed), made_up_s=MADE_UP_S) as behind,
    ):
        driver = wired_driver(Path(name), behind, 1.0, after_demand_s=0.02)
        context = Context(replace(declared_unit(default_unit()), serial="GL017"), driver.description)
        params = RESPONSE.resolve(RESPONSE.params.model_validate(parameters), context)
        bench = driver.open("GL017", None, None, BenchNeeds())
        if stands:
            _stand_still(behind)
        try:
            recordings = asyncio.run(acquired(bench, RESPONSE, RESPONSE.schedule(params)))
        finally:
            bench.close()
        print(f"  {behind.bench.pace.behind_s:.2f} s of bench time given up")
        try:
            found = RESPONSE.analyse(recordings, params, context)
        except UnfitRecording as refusal:
            return f"{REFUSED}{refusal}"
    for warning in found.warnings:
        print(f"  warning: {warning}")
    return _told(found)


def _told(found: Any) -> str:
    parts: list[str] = []
    for c in found.gyro.channels:
        sd = c.delay_standard_uncertainty_s
        wrong = "" if abs(c.delay_s) <= STAMPS_S + SIGMAS * sd else " WRONG"
        parts.append(f"{c.channel} {1e3 * c.delay_s:+.2f} ± {1e3 * sd:.2f} ms{wrong}")
    scatter = 1e3 * found.gyro.stamp_scatter_s
    return f"{found.verdict.value}: delays {', '.join(parts)}; stamps scatter by {scatter:.2f} ms"


def _stand_still(behind: Served) -> None:
    """Have the loop of the served world sleep for 1.4 s every 3 s, as on a machine that is too slow."""

    def again(bench: Any) -> None:
        time.sleep(1.4)
        asyncio.get_running_loop().call_later(3.0, again, bench)

    behind.do(again)


def main() -> int:
    """Three scenes."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--seed", type=int, default=3)
    parser.add_argument("--axes", nargs="+", default=["x"], choices=("x", "y", "z"))
    parser.add_argument("--record-s", type=float, default=5.0)
    parser.add_argument("--frequencies-hz", type=float, nargs="+", default=[1.0, 2.0, 4.0, 8.0])
    given = parser.parse_args()
    parameters = {"axes": given.axes, "record_s": given.record_s, "frequencies_hz": given.frequencies_hz}
    scenes: tuple[tuple[str, float, bool, Callable[[str], bool]], ...] = (
        ("the world keeps time", 1.0, False, lambda told: "WRONG" not in told),
        ("the world runs slower by 2 %", 0.98, False, lambda told: told.startswith(REFUSED)),
        ("the world stands still for 1.4 s every 3 s", 1.0, True, lambda told: told.startswith(REFUSED)),
    )
    wrong: list[str] = []
    for name, pace, stands, kept in scenes:
        print(f"{name} (load average {os.getloadavg()[0]:.1f})", flush=True)
        told = response(pace, stands, given.seed, parameters)
        print(f"  {told}", flush=True)
        wrong += [] if kept(told) else [name]
    print(*(f"NOT KEPT: {name}" for name in wrong) if wrong else ["every promise was kept"], sep="\n")
    return 1 if wrong else 0


if __name__ == "__main__":
    sys.exit(main())
