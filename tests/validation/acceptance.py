"""The campaign `acceptance`: do sound units pass, and are faults found and named?

``python -m tests.validation.acceptance [--seeds N] [--each E] [--whole K] [--fault-seeds M] [--only FAULT]``
(``make validate``). Launches and thermal legs are scaled (`acceptance_rig.SCALED`), the table follows exactly
(`light_bench`), and E runs share the static launches, the converter and the thermal cycle of one unit, the first of
them with the inspection of its recordings; K runs are whole, with the servo, each with its own. A fault of a later
launch is put into runs that were sound so far. Beside the outcome of the sound runs stands what the campaign's preview
foresaw of each check (`acceptance_preview`).
Exit code 1 where passes or detections are fewer than 95 % of the runs allow: by the binomial distribution at 1 %.
"""

import argparse
import os
import sys
from collections import Counter
from collections.abc import Iterable, Sequence
from concurrent.futures import ProcessPoolExecutor
from functools import partial
from math import isfinite

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")  # before numpy: one thread a worker

from rich.console import Console
from scipy.stats import binom

from bench_service.campaigns.campaign import Campaign
from bench_service.campaigns.shipped import shipped
from procedures.core.limits import Verdict
from tests.validation import light_bench
from tests.validation.acceptance_faults import AFTER, Fault, faults
from tests.validation.acceptance_preview import LEVEL as LEVEL_OF_INTERVALS
from tests.validation.acceptance_preview import Values, foreseen, table_of, values_of
from tests.validation.acceptance_rig import Course, course, scaled, told

SHARE, LEVEL = 0.95, 0.01
BASE, NEXT = 1_000_000, 1000
"""Seeds of units are `BASE` apart, of their runs `NEXT`: each step takes the next one."""
NONE = Fault("none")
Ended = tuple[str, list[str]]
"""Verdict of a run, and all that failed in it."""


def least(seeds: int) -> int:
    """Fewest successes that a true share of 95 % gives with probability 99 %."""
    return int(binom.ppf(LEVEL, seeds, SHARE))


def ended(found: Course) -> Ended:
    """Verdict of a run, and all that failed."""
    return (found.run.verdict or Verdict.ERROR).value, told(found.run)


def sound(unit: int, campaign: Campaign, each: int) -> list[tuple[Ended, Values]]:
    """Runs of one sound unit that share its launches and its thermal cycle, with the values of their checks."""
    first = course(campaign, BASE * (unit + 1), NONE, until="scale_1")
    seeds = [BASE * (unit + 1) + NEXT * (k + 1) for k in range(each)]
    runs = [course(campaign, seed, NONE, first, inspected=k == 0) for k, seed in enumerate(seeds)]
    return [(ended(found), values_of(found.run)) for found in runs]


def whole(unit: int, campaign: Campaign) -> Ended:
    """One run without any sharing."""
    return ended(course(campaign, BASE * (unit + 1), NONE))


def faulty(unit: int, campaign: Campaign, wanted: Sequence[str]) -> list[tuple[str, str, list[str], bool]]:
    """Runs of one unit with each of some faults: verdict, all that failed, and whether that names the fault.

    Recordings of a later launch are inspected in the first unit alone: those faults are not found by the inspection.
    """
    seed, found = BASE * (unit + 1), [f for f in faults(campaign) if f.name in wanted]
    late = [f for f in found if f.late]
    first = unit == 0
    before = course(campaign, seed, NONE, until=AFTER, inspected=first) if late else None
    runs = [
        (f, ended(course(campaign, seed, f, before if f.late else None, inspected=first or not f.late))) for f in found
    ]
    return [(f.name, verdict, said, names(f, said)) for f, (verdict, said) in runs]


def names(fault: Fault, said: Iterable[str]) -> bool:
    """Whether one sentence has all words of a fault."""
    return any(all(word in sentence for word in fault.names) for sentence in said)


def tell(runs: Sequence[Ended], title: str) -> bool:
    """Print how many passed, and by which checks the others failed."""
    passed = sum(verdict == "pass" for verdict, _ in runs)
    print(f"{title}: {passed} of {len(runs)} pass, at least {least(len(runs))} wanted", flush=True)
    for sentence, count in Counter(s for _, said in runs for s in said).most_common():
        print(f"  {count} x {sentence}")
    return passed >= least(len(runs))


def beside(campaign: Campaign, values: Sequence[Sequence[Values]]) -> None:
    """Print what the campaign's preview foresaw of each check beside the outcome of the sound runs; not judged."""
    light_bench.use()
    rows = foreseen(campaign, values)
    console = Console(width=150)
    console.print(table_of(rows))
    judged = [row for row in rows if isfinite(row.high)]
    apart, chance = sum(not row.holds for row in judged), LEVEL_OF_INTERVALS * len(judged)
    told = f"{apart} of {len(judged)} checks scatter otherwise than foreseen, {chance:.1f} by chance"
    console.print(f"Preview beside outcome, root mean squares over runs: {told}.")


def main() -> int:
    """Sound units, then each fault."""
    parser = argparse.ArgumentParser(description="The campaign acceptance on sound and faulty units")
    parser.add_argument("--seeds", type=int, default=200)
    parser.add_argument("--each", type=int, default=4, help="runs that share one unit's launches and thermal cycle")
    parser.add_argument("--whole", type=int, default=0, help="runs as the campaign ships")
    parser.add_argument("--fault-seeds", type=int, default=60)
    parser.add_argument("--only", action="append", default=[], help="this fault alone")
    parser.add_argument("--workers", type=int, default=min(2, os.cpu_count() or 1))
    options = parser.parse_args()
    campaign, held = scaled(), True
    if options.whole:
        with ProcessPoolExecutor(options.workers) as pool:
            ships = partial(whole, campaign=shipped()["acceptance"])
            held &= tell(list(pool.map(ships, range(options.whole))), "sound unit, whole")
    with ProcessPoolExecutor(options.workers, initializer=light_bench.use) as pool:
        units = range(-(-options.seeds // options.each))
        found: list[Ended] = []
        values: list[list[Values]] = []
        for of in pool.map(partial(sound, campaign=campaign, each=options.each), units):
            found += [run for run, _ in of]
            values.append([checks for _, checks in of])
            failed = [said for (verdict, said), _ in of if verdict != "pass"]
            print(
                f"  sound so far: {sum(v == 'pass' for v, _ in found)} of {len(found)} pass {failed or ''}", flush=True
            )
        held &= tell(found[: options.seeds], "sound unit") if options.seeds else True
        beside(campaign, values)
        every = [f for f in faults(campaign) if not options.only or f.name in options.only]
        wanted = [f.name for f in every if f.resolved]
        drawn = []
        for of_unit in pool.map(partial(faulty, campaign=campaign, wanted=wanted), range(options.fault_seeds)):
            drawn.append(of_unit)
            missed = [(name, verdict, said) for name, verdict, said, good in of_unit if verdict == "pass" or not good]
            print(
                f"  faults so far: {len(drawn)} units of {len(wanted)} faults; not found or not named: {missed}",
                flush=True,
            )
    for fault in every:
        if not fault.resolved:
            print(f"{fault.name}: not resolved by the plan, {fault.size}")
            continue
        of = [one for unit in drawn for one in unit if one[0] == fault.name]
        detected, named = sum(one[1] != "pass" for one in of), sum(one[3] for one in of)
        print(f"{fault.name}, {fault.size}: {detected} of {len(of)} found, {named} named by {fault.names}")
        for sentence, count in Counter(s for one in of for s in one[2]).most_common(4):
            print(f"  {count} x {sentence}")
        held &= min(detected, named) >= least(len(of))
    print("as claimed" if held else "NOT as claimed")
    return 0 if held else 1


if __name__ == "__main__":
    sys.exit(main())
