"""``make bench-against REV=…``: this checkout beside an older revision, in turns in one run; ratios of medians.

    python -m tests.benchmarks.against [--rev e36ea0a] [--rounds 5] [--only static,allan]

The older one is built in a temporary folder by its own Makefile. A round measures both, in the order old, new, new, old
and so on: a machine that becomes slower is slower for both. Nothing here fails: it prints.
"""

import argparse
import os
import statistics
import subprocess
import sys

from tests.benchmarks.measures import MEASURES, Figures
from tests.benchmarks.revision import Revision, built, here

Series = dict[str, list[float]]


def main() -> int:
    """Measure both revisions and print; 1 only where one of them cannot be built or run."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--rev", default="e36ea0a")
    parser.add_argument("--rounds", type=int, default=5)
    parser.add_argument("--only", default=",".join(MEASURES), help="some of " + ", ".join(MEASURES))
    given = parser.parse_args()
    try:
        with built(given.rev) as old:
            new = here()
            for revision in (old, new):
                revision.compile()
            print(f"{new.commit} beside {old.name}, medians of {given.rounds} rounds in turns; {load()}", flush=True)
            for name in given.only.split(","):
                _compare(name, old, new, given.rounds)
    except subprocess.CalledProcessError as failed:
        print(f"not run: {' '.join(failed.cmd[:6])} ended with {failed.returncode}", file=sys.stderr)
        return 1
    return 0


def load() -> str:
    """How busy the machine was: a ratio of wall times of a busy machine says less."""
    return f"{os.cpu_count()} processors, load {os.getloadavg()[0]:.1f} in the last minute"


def _compare(name: str, old: Revision, new: Revision, rounds: int) -> None:
    before: Series = {}
    after: Series = {}
    for number in range(rounds):
        turns = [(old, before), (new, after)]
        for revision, into in turns if number % 2 == 0 else reversed(turns):
            _add(into, MEASURES[name](revision))
    print(f"{name} ({load()})")
    for label, values in after.items():
        ours, theirs = statistics.median(values), statistics.median(before[label])
        ratio = f"{ours / theirs:.2f}" if theirs else "–"
        print(f"  {label:44} {theirs:9.3f} -> {ours:9.3f}  ratio {ratio}  ({_spread(values)})", flush=True)


def _add(into: Series, figures: Figures) -> None:
    for label, value in figures.items():
        into.setdefault(label, []).append(value)


def _spread(values: list[float]) -> str:
    return f"{min(values):.3g} to {max(values):.3g}"


if __name__ == "__main__":
    sys.exit(main())
