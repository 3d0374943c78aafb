"""Monte Carlo against theory: are the calibration's errors what it claims and what theory allows?

``python -m tests.validation.calibration [--units N] [--workers N]`` (``make validate``). Exit code 1 if anything lies
outside the tolerance of the sample.
"""

import argparse
import os
import sys

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")  # before numpy: one thread a worker

from rich.console import Console
from rich.progress import track
from rich.table import Table

from tests.validation.judgement import FAMILY_LEVEL, NAMES, Check, Column, checks, columns, failures, misdeclared
from tests.validation.population import (
    CALIBRATION,
    MISDECLARED,
    SCENARIOS,
    THESIS,
    Outcome,
    Scenario,
    population,
    stacked,
)

WIDTH = 150
LEGEND = """\
sd: spread of the errors, each relative to its own unit's figure. claimed: by the result. bound: Bayesian Cramér-Rao
bound of both triads at once, the table's flaws unknown with their declared spreads; for the noise's weights, what least
squares on a table taken as declared can reach. preview: for a unit that has a calibration. Not judged: noise bound:
Cramér-Rao with a table known to be ideal; thesis bound, joint bound: the two bounds beside each other; first preview:
for a unit never calibrated, which takes its nominal scale for true (the accelerometers' is 16 % off)."""
THESIS_PART, MISDECLARED_PART = 4, 10
"""Of the units asked for, one in so many."""


def coefficient_table(scenario: Scenario, units: int, figures: list[Column]) -> Table:
    """A row a coefficient, tolerances in the headings; what fails is marked."""
    table = Table(title=f"{scenario.title}: {units} units", title_style="bold")
    table.add_column("coefficient", no_wrap=True)
    for figure in figures:
        limits = "not judged" if figure.allowed is None else "{:.3g} … {:.3g}".format(*figure.allowed)
        table.add_column(f"{figure.title}\n{limits}", justify="right")
    table.add_column("")
    for i, name in enumerate(NAMES):
        cells = [f"{f.values[i]:.3f}" if f.passed[i] else f"[red]{f.values[i]:.3f} ![/red]" for f in figures]
        table.add_row(name, *cells, verdict(all(f.passed[i] for f in figures)))
    return table


def check_table(figures: list[Check]) -> Table:
    """A row a figure of the whole population."""
    table = Table("figure of the population", "value", "allowed", "")
    for c in figures:
        table.add_row(c.name, f"{c.value:.4f}", f"{c.low:.3g} … {c.high:.3g}", verdict(c.passed))
    return table


def verdict(passed: bool) -> str:
    """In colour where there is any."""
    return "[green]OK[/green]" if passed else "[red]FAIL[/red]"


def show(scenario: Scenario, outcome: Outcome, console: Console) -> list[str]:
    """Print one population and return what failed."""
    console.print(coefficient_table(scenario, len(outcome.errors), columns(outcome)))
    console.print(check_table(checks(outcome)))
    return [f"{scenario.title}: {failure}" for failure in failures(outcome)]


def misdeclared_table(outcomes: list[tuple[Scenario, Outcome]]) -> Table:
    """Two rows a scenario: how often the chi-square finds it out, and what it costs; for information."""
    table = Table(title="Tables not as declared", title_style="bold")
    headings = ("table", "units", "triad", "χ² refuses", "sd / claimed", "sd / noise bound")
    for heading in headings:
        table.add_column(heading)
    limit = CALIBRATION.params().limits.residual_p_value_min
    for scenario, outcome in outcomes:
        for m in misdeclared(outcome, limit):
            ranges = ["{:.2f} … {:.2f}".format(*r) for r in (m.claimed, m.noise_bound)]
            table.add_row(scenario.title, str(len(outcome.errors)), m.triad, f"{100 * m.detected:.0f} %", *ranges)
    return table


def main() -> int:
    """All scenarios, one after the other."""
    parser = argparse.ArgumentParser(description="Monte Carlo of the calibration against theory")
    parser.add_argument("--units", type=int, default=1000, help="simulated units a scenario (at least 20)")
    parser.add_argument("--workers", type=int, default=min(2, os.cpu_count() or 1))
    options = parser.parse_args()
    if options.units < 20 or options.workers < 1:
        parser.error("at least 20 units and one worker")
    console, progress = Console(width=WIDTH), Console(stderr=True)
    failed: list[str] = []

    def drawn(scenario: Scenario, part: int = 1) -> Outcome:
        total = max(20, options.units // part)
        units = population(scenario, total, options.workers)
        return stacked(list(track(units, scenario.title, total=total, console=progress)))

    for scenario in SCENARIOS:
        failed += show(scenario, drawn(scenario), console)
    failed += show(THESIS, drawn(THESIS, THESIS_PART), console)
    console.print(misdeclared_table([(scenario, drawn(scenario, MISDECLARED_PART)) for scenario in MISDECLARED]))
    console.print(LEGEND, highlight=False)
    console.print(f"Together the checks of a scenario fail by chance with probability {FAMILY_LEVEL:g}.")
    for failure in failed:
        console.print(f"[red]FAIL[/red] {failure}")
    console.print("[red]FAILED[/red]" if failed else "[green]All within tolerance.[/green]")
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main())
