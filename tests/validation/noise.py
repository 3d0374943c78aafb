"""Monte Carlo against theory: are the noise coefficients unbiased, as sharp as can be, and honest about themselves?

``python -m tests.validation.noise [--records N]``. Exit code 1 if anything lies outside the tolerance of the sample.
"""

import argparse
import os
import sys

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")  # before numpy: one thread

from collections.abc import Iterator

import numpy as np
from rich.console import Console
from rich.progress import track
from rich.table import Table

from procedures.analysis.allan.deviation import deviation
from procedures.analysis.allan.read_off import read_off
from procedures.analysis.allan.statistic import log_sizes
from procedures.analysis.noise_fit.least_squares import fit_allan
from procedures.analysis.noise_fit.likelihood import fit_noise
from procedures.analysis.noise_fit.powers import FastPowers, slow_powers
from simulators.truth import Array
from tests.validation.noise_judgement import Answer, Outcome, failures, from_fit, from_read_off, summary
from tests.validation.noise_records import (
    ACCELEROMETER,
    ALONE,
    GYRO,
    MIXTURES,
    PROCESSES,
    RATE_HZ,
    Scenario,
    cell_records,
    cramer_rao,
    full_rate_blocks,
)

WIDTH = 150
POINTS = 60
"""Averaging times of an Allan deviation that is read or fitted."""
ALONE_PART, COMPARED_PART, FULL_RATE_PART = 4, 4, 16
"""Of the records asked for, one in so many."""
LEGEND = """\
Errors are relative to the truth, over the records that show the process. bound: Cramér-Rao, all others unknown. A
process is observable where its bound is below 10 %; only there is its spread judged. (a) read off an Allan deviation,
(b) least squares of it, (c) likelihood of the spectrum of the cell means, or of the full rate where it is said."""


def channels(scenario: Scenario, records: int) -> Iterator[Array]:
    """Cell means of some records, (n,) each."""
    for seed in range((records + 2) // 3):
        yield from cell_records(scenario, seed)[: records - 3 * seed]


def by_likelihood(cells: Array) -> Answer:
    """(c) from cell means."""
    return from_fit(fit_noise(slow_powers(cells, 1.0)))


def by_allan(cells: Array) -> tuple[Answer, Answer]:
    """(a) and (b)."""
    curve = deviation(cells, 1.0, sizes=log_sizes(len(cells) // 2, POINTS))
    return from_read_off(read_off(curve)), from_fit(fit_allan(curve))


def full_rate(scenario: Scenario, seed: int) -> Answer:
    """(c) from 400 Hz samples and their cell means."""
    fast, means = FastPowers(RATE_HZ), []
    for block in full_rate_blocks(scenario, seed):
        fast.add(block)
        means.append(block.reshape(-1, int(RATE_HZ)).mean(axis=1))
    return from_fit(fit_noise(slow_powers(np.concatenate(means), 1.0), fast.finish()))


def table(outcome: Outcome) -> Table:
    """A row a process."""
    heading = f"{outcome.title}, {outcome.method}: {len(outcome.answers)} records"
    shown = Table(title=heading, title_style="bold")
    for name in ("process", "seen", "bias", "spread", "bound", "RMSE / bound", "claimed / spread", "in 95 %", "limit"):
        shown.add_column(name, justify="left" if name == "process" else "right")
    for process in PROCESSES:
        shown.add_row(process.replace("_", " "), *summary(outcome, process))
    return shown


def main() -> int:
    """All scenarios, one after the other."""
    parser = argparse.ArgumentParser(description="Monte Carlo of the noise coefficients against theory")
    parser.add_argument("--records", type=int, default=200, help="records of a mixture (at least 20)")
    options = parser.parse_args()
    if options.records < 20:
        parser.error("at least 20 records")
    console, progress = Console(width=WIDTH), Console(stderr=True)
    judged: list[Outcome] = []
    compared: list[Outcome] = []
    for scenario in (*ALONE, *MIXTURES):
        records = options.records if scenario in MIXTURES else max(20, options.records // ALONE_PART)
        answers: list[Answer] = []
        allan: list[tuple[Answer, Answer]] = []
        for cells in track(channels(scenario, records), scenario.title, total=records, console=progress):
            answers.append(by_likelihood(cells))
            if scenario in MIXTURES and len(allan) < records // COMPARED_PART:
                allan.append(by_allan(cells))
        bound = cramer_rao(scenario)
        judged.append(Outcome(scenario, "(c)", bound, answers))
        if allan:
            compared += [Outcome(scenario, f"({m})", bound, [a[i] for a in allan]) for i, m in enumerate("ab")]
    for scenario in (GYRO, ACCELEROMETER):
        seeds = range(max(2, options.records // FULL_RATE_PART))
        found = [full_rate(scenario, s) for s in track(seeds, f"{scenario.title}, 400 Hz", console=progress)]
        judged.append(Outcome(scenario, "(c) at 400 Hz", cramer_rao(scenario, 1.0 / RATE_HZ), found))
    for outcome in (*judged, *compared):
        console.print(table(outcome))
    console.print(LEGEND, highlight=False)
    failed = [failure for outcome in judged for failure in failures(outcome)]
    for failure in failed:
        console.print(f"[red]FAIL[/red] {failure}")
    console.print("[red]FAILED[/red]" if failed else "[green]All within tolerance.[/green]")
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main())
