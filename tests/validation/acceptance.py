"""The campaign `acceptance`: do sound units pass, and are faults found and named?

``python -m tests.validation.acceptance [--seeds N] [--fault-seeds M] [--workers N]`` (``make validate``). Launches and
thermal legs are scaled (`acceptance_rig.SCALED`). Exit code 1 where the passes or the detections are fewer than 95 % of
the seeds allow: by the binomial distribution at 1 %.
"""

import argparse
import os
import sys
from collections import Counter
from concurrent.futures import ProcessPoolExecutor
from functools import partial

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")  # before numpy: one thread a worker

from scipy.stats import binom

from bench_service.campaigns.campaign import Campaign
from procedures.core.limits import Verdict
from tests.validation.acceptance_faults import Fault, faults
from tests.validation.acceptance_rig import course, scaled, told

SHARE, LEVEL = 0.95, 0.01
BASE = 1000
"""Seeds of runs are this far apart: each step takes the next one."""


def least(seeds: int) -> int:
    """Fewest successes that a true share of 95 % gives with probability 99 %."""
    return int(binom.ppf(LEVEL, seeds, SHARE))


def one(number: int, campaign: Campaign, fault: str | None) -> tuple[str, list[str], bool]:
    """Verdict, all that failed, and whether that names the fault."""
    wanted = Fault("none") if fault is None else next(f for f in faults(campaign) if f.name == fault)
    run = course(campaign, BASE * (number + 1), wanted)
    said = told(run)
    named = any(all(word in sentence for word in wanted.names) for sentence in said)
    return (run.verdict or Verdict.ERROR).value, said, named


def main() -> int:
    """Sound units, then each fault."""
    parser = argparse.ArgumentParser(description="The campaign acceptance on sound and faulty units")
    parser.add_argument("--seeds", type=int, default=200)
    parser.add_argument("--fault-seeds", type=int, default=60)
    parser.add_argument("--workers", type=int, default=min(2, os.cpu_count() or 1))
    options = parser.parse_args()
    campaign, held = scaled(), True
    with ProcessPoolExecutor(options.workers) as pool:
        found = list(pool.map(partial(one, campaign=campaign, fault=None), range(options.seeds)))
        passed = sum(verdict == "pass" for verdict, _, _ in found)
        print(f"sound unit: {passed} of {len(found)} pass, at least {least(len(found))} wanted")
        for sentence, count in Counter(s for _, said, _ in found for s in said).most_common():
            print(f"  {count} x {sentence}")
        held &= passed >= least(len(found))
        for fault in faults(campaign):
            drawn = list(pool.map(partial(one, campaign=campaign, fault=fault.name), range(options.fault_seeds)))
            detected = sum(verdict != "pass" for verdict, _, _ in drawn)
            named = sum(good for _, _, good in drawn)
            print(f"{fault.name}, {fault.size}: {detected} of {len(drawn)} found, {named} named by {fault.names}")
            for sentence, count in Counter(s for _, said, _ in drawn for s in said).most_common(4):
                print(f"  {count} x {sentence}")
            held &= min(detected, named) >= least(len(drawn))
    print("as claimed" if held else "NOT as claimed")
    return 0 if held else 1


if __name__ == "__main__":
    sys.exit(main())
