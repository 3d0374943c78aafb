"""Misfits of a broken calibration, drawn at random: is it refused or failed, and does a clean one pass?

``python -m tests.validation.misfit [--draws N] [--coverage N]`` (``make validate``). The generator knows nothing of the
product: rotations by quaternions, noise by its own recursions. Exit code 1 where a broken input passes without a word,
where a clean one fails more often than one in twenty (beyond chance), or where intervals do not hold.
"""

import argparse
import os
import sys
from collections.abc import Callable

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")  # before numpy

import numpy as np
from rich.console import Console
from rich.table import Table as ScreenTable
from scipy.stats import binom

from tests.cases import calibrations as made
from tests.validation.judgement import Check

LEVEL = 1e-4
"""Chance of one check failing by accident."""


def broken(draws: int) -> list[Check]:
    """Share of broken inputs of each kind that are refused, failed or at least said to be unchecked."""
    found: list[Check] = []
    for k, (name, maker) in enumerate({**made.BROKEN_SCALAR, **made.BROKEN_FIELD}.items()):
        rng = np.random.default_rng([14, k])
        caught = [made.outcome(maker(rng)).caught for _ in range(draws)]
        found.append(Check(f"broken, {name}: caught", float(np.mean(caught)), 1.0, 1.0))
    return found


def clean(draws: int) -> list[Check]:
    """Share of clean inputs that pass."""
    found: list[Check] = []
    for k, (name, maker) in enumerate({**made.CLEAN_SCALAR, **made.CLEAN_FIELD}.items()):
        rng = np.random.default_rng([15, k])
        passed = [made.outcome(maker(rng)).passed for _ in range(draws)]
        low = float(binom.ppf(LEVEL, draws, 0.95)) / draws
        found.append(Check(f"clean, {name}: passed", float(np.mean(passed)), low, 1.0))
    return found


def coverage(draws: int) -> list[Check]:
    """Share of the nine true values inside 95 % intervals of clean scalar calibrations of unknown noise."""
    rng = np.random.default_rng(16)
    inside = np.mean([made.inside(made.clean_scalar(rng, "white"), 1.96) for _ in range(draws)])
    return [Check(f"scalar, white noise, {draws} calibrations: inside ±1.96 u", float(inside), 0.92, 0.98)]


PARTS: dict[str, Callable[[int, int], list[Check]]] = {
    "broken inputs": lambda draws, _: broken(draws),
    "clean inputs": lambda draws, _: clean(5 * draws),
    "coverage": lambda _, many: coverage(many),
}


def main() -> int:
    """All parts, one after the other."""
    parser = argparse.ArgumentParser(description="Broken and clean calibrations drawn at random")
    parser.add_argument("--draws", type=int, default=20, help="inputs of each broken kind (five times as many clean)")
    parser.add_argument("--coverage", type=int, default=400, help="clean calibrations for the intervals")
    options = parser.parse_args()
    console, failed = Console(width=150), False
    for title, part in PARTS.items():
        table = ScreenTable("figure", "value", "allowed", "", title=title)
        for c in part(options.draws, options.coverage):
            table.add_row(c.name, f"{c.value:.4f}", f"{c.low:.3g} … {c.high:.3g}", "OK" if c.passed else "FAIL")
            failed |= not c.passed
        console.print(table)
    console.print("[red]FAILED[/red]" if failed else "[green]All within tolerance.[/green]")
    return int(failed)


if __name__ == "__main__":
    sys.exit(main())
