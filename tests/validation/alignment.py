"""Monte Carlo of the initial alignment at two latitudes: does the heading err as predicted?

``python -m tests.validation.alignment [--units N]`` (``make validate``). Exit code 1 if anything lies outside the
tolerance of the sample: together the checks fail by chance in less than one of a thousand runs.

Repeated: one calibrated unit, switched off and aligned N times. Units: N units drawn, each calibrated on one drawn
table and aligned at two attitudes on another. Not judged: the same on the table that calibrated the unit, where a part
of the table's errors cancels that the prediction counts twice.
"""

import argparse
import os
import sys
from collections.abc import Callable, Iterator
from dataclasses import replace

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")  # before numpy

import numpy as np
from rich.console import Console
from rich.table import Table as ScreenTable
from scipy.stats import chi2, kstest, norm

from procedures.analysis.calibration.reference import TRIAD_NAMES
from procedures.analysis.calibration.triad_analysis import analyse_triad
from procedures.catalog import discover
from procedures.core.recording import Recording
from procedures.core.unit import Unit
from procedures.procedure import Context
from simulators.truth import BenchTruth, SiteTruth, UnitTruth, declared_unit, default_unit, random_unit_truth
from simulators.world import WorldConfig
from tests.validation.judgement import FAMILY_LEVEL, LEVEL, Check, spread_limits
from tests.validation.population import CALIBRATION, SCENARIOS, recordings, table_uncertainty

PROCEDURE = discover()["initial_alignment"]
LATITUDES_DEG = (50.45, -68.0)
TABLE = SCENARIOS[2]
PLACES = ((0.0, 0.0, 0.0), (70.0, 10.0, -20.0))
MOST = 500
"""Repeated alignments: their covariance is a full matrix."""


def bench_at(latitude_deg: float, seed: int) -> BenchTruth:
    """A drawn table at some latitude."""
    bench = TABLE.bench(seed)
    site = replace(bench.description.site, latitude_deg=latitude_deg)
    truth = SiteTruth(latitude_deg, site.gravity_m_s2, site.earth_rate_rad_s)
    return replace(bench, site=truth, description=replace(bench.description, site=site))


def calibrated(truth: UnitTruth, bench: BenchTruth, seed: int) -> Unit:
    """The unit with what a calibration in twelve orientations, in launch 1, finds of it."""
    unit = declared_unit(truth)
    params = CALIBRATION.resolve(CALIBRATION.params(), Context(unit, bench.description))
    taken = recordings(WorldConfig(truth, bench, seed), CALIBRATION.schedule(params), 1)
    site, table = bench.description.site, table_uncertainty(bench.description)
    fits = [analyse_triad(taken, name, site, table, unit.triad(name)) for name in TRIAD_NAMES]
    return replace(unit, calibrations=tuple(f.calibration for f in fits))


def repeated(latitude_deg: float, units: int) -> list[Check]:
    """One unit, a launch each time."""
    n, seed = min(units, MOST), 7_000_000 + LATITUDES_DEG.index(latitude_deg)
    bench, truth = bench_at(latitude_deg, seed), default_unit()
    context = Context(calibrated(truth, bench, seed), bench.description)
    params = PROCEDURE.resolve(PROCEDURE.params(repetitions=1, alignment_s=300.0), context)
    (station,), taken = PROCEDURE.schedule(params), list[Recording]()
    for i in range(n):
        (one,) = recordings(WorldConfig(truth, bench, seed), [replace(station, index=i)], 2 + i)
        began = 1000.0 * i
        taken.append(replace(one, info=replace(one.info, start_s=began + one.info.start_s, launched_s=began)))
    heading = PROCEDURE.analyse(taken, params, context).angles[0]
    limits = (float(chi2.ppf(LEVEL / 2, n) / n), float(chi2.isf(LEVEL / 2, n) / n))
    sigmas = float(norm.isf(LEVEL / 2))
    return [
        Check(f"{n} alignments: heading, χ²/n", heading.chi_square / n, *limits),
        Check(
            f"{n} alignments: heading, spread / expected",
            heading.spread_deg / heading.expected_spread_deg,
            *spread_limits(n),
        ),
        Check(
            "heading, mean error / its expected sd",
            heading.mean_error_deg / heading.mean_error_expected_sd_deg,
            -sigmas,
            sigmas,
        ),
    ]


def drawn(latitude_deg: float, units: int, same_table: bool) -> Iterator[tuple[np.ndarray, np.ndarray]]:
    """Errors over their predicted sd at the first place (3,), and p-values of both places together (3,)."""
    first_seed = 8_000_000 + 10_000_000 * LATITUDES_DEG.index(latitude_deg)
    for seed in range(first_seed, first_seed + units):
        truth, bench = random_unit_truth(seed), bench_at(latitude_deg, seed)
        unit = calibrated(truth, bench, seed)
        there = bench if same_table else bench_at(latitude_deg, seed + 1_000_000)
        context = Context(unit, there.description)
        params = PROCEDURE.params(orientations=PLACES, repetitions=1, alignment_s=300.0, off_time_s=0.0)
        params = PROCEDURE.resolve(params, context)
        # Chance is keyed by seed, launch and move: another seed, so that no pointing error is the calibration's again.
        taken = recordings(WorldConfig(truth, there, seed + 1_000_000), PROCEDURE.schedule(params), 2)
        result = PROCEDURE.analyse(taken, params, context)
        first = result.alignments[0]
        yield np.divide(first.error_deg, first.expected_sd_deg), np.array([a.p_value for a in result.angles])


def population(latitude_deg: float, units: int) -> list[Check]:
    """Every angle of many units, calibrated on one table and aligned on another."""
    ratios, p_values = (np.array(x) for x in zip(*drawn(latitude_deg, units, same_table=False), strict=True))
    sigmas, found = float(norm.isf(LEVEL / 2)), list[Check]()
    for k, angle in enumerate(("heading", "pitch", "roll")):
        spread = float(ratios[:, k].std(ddof=1))
        mean = float(ratios[:, k].mean() * np.sqrt(units))
        uniform = float(kstest(p_values[:, k], "uniform").pvalue)
        found += [
            Check(f"{angle}, spread / predicted", spread, *spread_limits(units)),
            Check(f"{angle}, mean error / its se", mean, -sigmas, sigmas),
            Check(f"{angle}, KS test of p-values", uniform, LEVEL, 1.0),
        ]
    return found


def same_table(latitude_deg: float, units: int) -> list[Check]:
    """For information: calibrated and aligned on one table."""
    ratios = np.array([r for r, _ in drawn(latitude_deg, units, same_table=True)])
    return [
        Check(f"{angle}, spread / predicted", float(ratios[:, k].std(ddof=1)), 0.0, np.inf)
        for k, angle in enumerate(("heading", "pitch", "roll"))
    ]


PARTS: dict[str, tuple[Callable[[float, int], list[Check]], int]] = {
    "one unit, repeated": (repeated, 1),
    "units, another table": (population, 1),
    "units, the same table (not judged)": (same_table, 3),
}
"""What is drawn, and for one in how many of the units asked for."""


def main() -> int:
    """All parts at all latitudes."""
    parser = argparse.ArgumentParser(description="Monte Carlo of the initial alignment")
    parser.add_argument("--units", type=int, default=300, help="drawn units a part (at least 100)")
    options = parser.parse_args()
    if options.units < 100:
        parser.error("at least 100 units")
    console, failed = Console(width=150), False
    for latitude_deg in LATITUDES_DEG:
        for title, (part, share) in PARTS.items():
            table = ScreenTable("figure", "value", "allowed", "", title=f"latitude {latitude_deg:g}°: {title}")
            for c in part(latitude_deg, options.units // share):
                table.add_row(c.name, f"{c.value:.4f}", f"{c.low:.3g} … {c.high:.3g}", "OK" if c.passed else "FAIL")
                failed |= not c.passed
            console.print(table)
    console.print(f"Together the checks fail by chance with a probability of less than {FAMILY_LEVEL:g}.")
    console.print("[red]FAILED[/red]" if failed else "[green]All within tolerance.[/green]")
    return int(failed)


if __name__ == "__main__":
    sys.exit(main())
