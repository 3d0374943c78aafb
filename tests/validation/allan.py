"""Monte Carlo of the Allan family's intervals: do they hold the true deviation as often as they say?

``python -m tests.validation.allan [--records N]``. Records of each power law, whose true deviation is known in closed
form, go through the whole of `deviation`, identification of the noise included. Exit code 1 if a coverage lies outside
what is declared by more than the sample's size explains.
"""

import argparse
import os
import sys

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")  # before numpy

from rich.console import Console
from rich.progress import track
from rich.table import Table

from tests.validation.allan_coverage import CONFIDENCES, COUNT, FAMILY_LEVEL, NOISES, Coverage, coverages, failures

LEGEND = f"""\
{COUNT} samples a record. Each cell: coverage at 68.3 % and 95 % [%]; edf: Monte Carlo over formula, with the true noise
taken for known; known: part of the records whose noise was identified. ! outside what is declared."""


def table(rows: list[Coverage]) -> Table:
    """A row a statistic and cluster size, of one kind of noise."""
    found = Table(title=NOISES[rows[0].alpha], title_style="bold")
    for heading in ("statistic", "m", "edf", "edf, MC/formula", "known", *(f"{100 * c:.1f} %" for c in CONFIDENCES)):
        found.add_column(heading, justify="left" if heading == "statistic" else "right")
    for row in rows:
        cells = [
            f"{100 * p:.1f}" if low <= p <= high else f"[red]{100 * p:.1f} ![/red]"
            for p, (low, high) in zip(row.covered, row.allowed, strict=True)
        ]
        figures = (str(row.m), f"{row.edf:.1f}", f"{row.edf_ratio:.2f}", f"{row.identified:.2f}")
        found.add_row(row.statistic, *figures, *cells)
    return found


def main() -> int:
    """All noises, one after the other."""
    parser = argparse.ArgumentParser(description="Coverage of the intervals of Allan deviations")
    parser.add_argument("--records", type=int, default=1000, help="simulated records of each noise (at least 100)")
    options = parser.parse_args()
    if options.records < 100:
        parser.error("at least 100 records")
    console, progress = Console(width=110), Console(stderr=True)
    failed: list[str] = []
    for alpha in track(list(NOISES), "Allan intervals", console=progress):
        rows = coverages(alpha, options.records)
        console.print(table(rows))
        failed += failures(rows)
    console.print(LEGEND, highlight=False)
    console.print(f"Together the checks fail by chance with probability {FAMILY_LEVEL:g}.")
    for failure in failed:
        console.print(f"[red]FAIL[/red] {failure}")
    console.print("[red]FAILED[/red]" if failed else "[green]All within tolerance.[/green]")
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main())
