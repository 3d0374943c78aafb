"""Monte Carlo of dynamic responses: are the errors of gains, delays and lags what is claimed, and what was promised?

``python -m tests.validation.response [--units N]``. Exit code 1 if anything lies outside the tolerance of the sample.
Units of a known gain, delay and lag, their samples in closed form (`tests.kit.swung_units`); three populations: no lag,
a lag within the frequencies, and stamps that scatter from recording to recording.
"""

import argparse
import os
import sys
from collections.abc import Sequence
from dataclasses import dataclass, replace

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")  # before numpy: one thread

import numpy as np
from rich.console import Console
from rich.progress import track
from rich.table import Table
from scipy.stats import binom, chi2, kstest, norm, t

from procedures.catalog.dynamic_response import PROCEDURE
from procedures.core.recording import AXES
from tests.kit.procedures import simulated_context
from tests.kit.swung_units import SwungUnit, swung

CONTEXT = simulated_context()
PARAMS = PROCEDURE.resolve(
    PROCEDURE.params(
        frequencies_hz=(0.5, 1.0, 2.0, 4.0, 8.0),
        record_s=4.0,
        linearity_ppm=0.0,
        encoder_sd_arcsec=0.1,
        encoder_rate_hz=80.0,
        axes=("x",),
    ),
    CONTEXT,
)
NAMES = ("gain", "delay", "time constant")
LEVEL = 1e-3 / 24
"""Three populations, of each up to eight figures: all together fail by chance once in a thousand."""


@dataclass(frozen=True)
class Outcome:
    """Outcome of one unit: errors and claims of `NAMES`, preview of gain and delay, p-value; nan: not told."""

    errors: np.ndarray
    claimed: np.ndarray
    previewed: np.ndarray
    p_value: float
    scatter_s: float
    bandwidth_holds: bool
    """False where the true bandwidth is below the limit that holds with 95 %."""


def drawn(unit: SwungUnit, seed: int) -> Outcome:
    """One unit from its truth to its errors."""
    assert CONTEXT.unit.gyro is not None
    unit = replace(unit, noise=replace(CONTEXT.unit.gyro.noise[0], rate_ramp=0.0))
    stations = PROCEDURE.schedule(PARAMS)
    taken = swung(unit, stations, [AXES.index(s.label[0]) for s in stations], seed)
    found = PROCEDURE.analyse(taken, PARAMS, CONTEXT).gyro
    c = found.channels[0]
    nan = float("nan")
    constant = (nan, nan) if c.time_constant_s is None else (c.time_constant_s, c.time_constant_standard_uncertainty_s)
    errors = [c.gain - unit.gain, c.delay_s - unit.delay_s - unit.time_constant_s, constant[0] - unit.time_constant_s]
    promised = {u.name: u.standard_uncertainty for u in PROCEDURE.predict(PARAMS, CONTEXT).uncertainties}
    assert c.p_value is not None
    true_hz = np.inf if unit.time_constant_s == 0.0 else 1.0 / (2.0 * np.pi * unit.time_constant_s)
    return Outcome(
        np.array(errors),
        np.array([c.gain_standard_uncertainty, c.delay_standard_uncertainty_s, constant[1]]),
        np.array([promised["gyro.gain_x"] * unit.gain, promised["gyro.delay_x"], nan]),
        c.p_value,
        found.stamp_scatter_s,
        true_hz >= c.bandwidth_above_hz,
    )


def show(title: str, outcomes: Sequence[Outcome], scatters: bool, lags: bool, console: Console) -> list[str]:
    """Print a population; a sentence for each figure outside what its size allows."""
    errors, claimed, previewed = (
        np.array([getattr(o, f) for o in outcomes]) for f in ("errors", "claimed", "previewed")
    )
    n, z = len(outcomes), errors / claimed
    table = Table(title=f"{title}: {n} units", title_style="bold")
    for heading in ("", "claimed", "rms / claimed", "allowed", "mean·√n", "preview / claimed"):
        table.add_column(heading, justify="right")
    found: list[str] = []
    for i, name in enumerate(NAMES):
        if name == "time constant" and not lags:
            continue
        # With stamps that scatter the claim rests on the residuals' degrees of freedom: Student's t is tested below.
        rms, mean = float(np.sqrt(np.mean(z[:, i] ** 2))), float(z[:, i].mean() * np.sqrt(n))
        low, high = (float(np.sqrt(f(LEVEL / 2, n) / n)) for f in (chi2.ppf, chi2.isf))
        judged = not (scatters and name != "gain")
        ratio = float(np.mean(previewed[:, i] / claimed[:, i]))
        table.add_row(
            name,
            f"{claimed[:, i].mean():.3g}",
            f"{rms:.3f}",
            f"{low:.2f} … {high:.2f}" if judged else "not judged",
            f"{mean:+.2f}",
            f"{ratio:.3f}",
        )
        if judged and (not low <= rms <= high or abs(mean) > norm.isf(LEVEL / 2)):
            found.append(f"{title}: {name}: rms / claimed {rms:.3f}, mean·√n {mean:+.2f}")
    console.print(table)
    p = float(kstest([o.p_value for o in outcomes], "uniform").pvalue)
    misses = sum(not o.bandwidth_holds for o in outcomes)
    scatter = float(np.sqrt(np.mean([o.scatter_s**2 for o in outcomes])))
    shown = sum(o.scatter_s > 0.0 for o in outcomes)
    console.print(
        f"KS p of the p-values {p:.3g}; scatter told of {shown}, rms {1e3 * scatter:.3g} ms; "
        f"true bandwidth below its 95 % limit {misses} times\n"
    )
    if scatters:
        # The delays of the recordings are alike in weight: their mean over its estimated deviation is Student's t.
        student = float(kstest(z[:, 1], t(len(PARAMS.frequencies_hz) - 1).cdf).pvalue)
        console.print(f"delay over its uncertainty against Student's t: KS p {student:.3g}")
        found += [f"{title}: the delay is not Student's t, KS p {student:.3g}"] if student < LEVEL else []
    if not scatters and p < LEVEL:
        found.append(f"{title}: p-values are not uniform, KS p {p:.3g}")
    if not scatters and shown > binomial_most(n, 1e-3):
        found.append(f"{title}: a scatter of the stamps is told of {shown} units, and none was put in")
    if misses > binomial_most(n, 0.05):
        found.append(f"{title}: the true bandwidth is below its limit {misses} times")
    return found


def binomial_most(n: int, share: float) -> int:
    """Largest number of n trials, each successful with this chance, that chance alone makes likely (`LEVEL`)."""
    return int(binom.isf(LEVEL, n, share))


def main() -> int:
    """Three populations."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--units", type=int, default=200)
    wanted = parser.parse_args()
    console, found = Console(width=110), list[str]()
    for title, unit, first in (
        ("no lag, delay 2.5 ms", SwungUnit(1.002, 2.5e-3), 1_000),
        ("lag 5 ms (31.8 Hz), delay 1 ms", SwungUnit(0.98, 1e-3, 5e-3), 100_000),
        ("stamps scatter by 1 ms", SwungUnit(1.0, 2e-3, stamp_sd_s=1e-3), 200_000),
    ):
        seeds = range(first, first + wanted.units)
        made = [drawn(unit, seed) for seed in track(seeds, title, console=console)]
        found += show(title, made, unit.stamp_sd_s > 0.0, unit.time_constant_s > 0.0, console)
    console.print("\n".join(found) if found else "[green]all within the tolerance of the sample[/green]")
    return 1 if found else 0


if __name__ == "__main__":
    sys.exit(main())
