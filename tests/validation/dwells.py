"""Monte Carlo of the stop rule: spread of stopped dwells against fixed ones, bias, and the time that was saved.

``python -m tests.validation.dwells [--units N] [--procedure-units M]``. Exit code 1 if anything lies outside the
tolerance. Units are drawn; the noise is the simulator's own, which the rule knows by the coefficients of the unit's
record alone. First single dwells of N units; then each procedure that takes `stop_at` with M units
(`dwell_procedures`), group of coefficients by group. One process; about 1 s of processor a unit and its procedures.
"""

import argparse
import os
import sys
from dataclasses import replace

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")  # before numpy: one thread

import numpy as np
from rich.console import Console
from rich.progress import track
from scipy.stats import chi2, norm

from procedures.analysis.recursive_bias.dwell import LiveDwell, expected_s, mean_sd
from procedures.core import units
from procedures.core.recording import GYRO, Channel, Quantity
from procedures.core.stop_rule import ChannelTarget, StopRule
from simulators.imu.noise import TriadNoise
from simulators.truth import Array, declared_unit, random_unit_truth
from tests.validation import dwell_procedures, light_bench
from tests.validation.judgement import Check
from tests.validation.thermal import table_of

RATE_HZ, LONGEST_S, BLOCK_S = 50.0, 200.0, 5.0
TARGET = 0.02 * units.DEG_PER_HOUR
CHANNELS = tuple(Channel(name, Quantity.ANGULAR_RATE, "rad/s") for name in GYRO)
FAMILY_LEVEL = 1e-3
LEVEL = FAMILY_LEVEL / 4
WITHIN = 0.1
"""Largest difference from 1 of the ratio of the two spreads that counts as none."""


def dwell(seed: int, scale: float = 1.0) -> tuple[Array, Array, Array, float, float]:
    """Means of a stopped and of a fixed dwell and what is claimed of the fixed one, (3,); durations of both [s].

    The fixed dwell is the one of the same target, by the unit's declared noise. `scale`: true noise over the declared.
    """
    truth = random_unit_truth(seed)
    record = declared_unit(truth).gyro
    assert record is not None
    rule = StopRule(tuple(ChannelTarget(n, TARGET, noise) for n, noise in zip(GYRO, record.noise, strict=True)))
    quiet = replace(truth.gyro, dither_residue=(0.0, 0.0, 0.0))
    count = round(LONGEST_S * RATE_HZ)
    noise = TriadNoise(quiet, RATE_HZ, (seed, 1, "gyro")).increments(0, count)
    readings = np.array(quiet.quantization)[:, None] * np.random.Generator(np.random.PCG64(seed)).standard_normal(
        (3, count + 1)
    )
    rates = scale * (noise + np.diff(readings, axis=1)).T * RATE_HZ
    live, step, taken = LiveDwell(rule, CHANNELS, RATE_HZ, LONGEST_S), round(BLOCK_S * RATE_HZ), 0
    for at in range(0, count, step):
        last = live.add(rates[at : at + step])
        taken = at + (step if last is None else last)
        if last is not None:
            break
    fixed = expected_s(rule, LONGEST_S)
    claimed = np.array([mean_sd(n, fixed) for n in record.noise])
    means = rates[:taken].mean(axis=0), rates[: round(fixed * RATE_HZ)].mean(axis=0)
    return means[0], means[1], claimed, taken / RATE_HZ, fixed


def checks_of(count: int, console: Console) -> list[Check]:
    """Spread, bias, claims and the guard."""
    rows = [dwell(seed) for seed in track(range(count), "dwells", console=Console(stderr=True))]
    stopped, fixed, claimed = (np.array([r[k] for r in rows]) for k in range(3))
    took, plan = (np.array([r[k] for r in rows]) for k in (3, 4))
    z = (stopped / claimed).ravel()
    low, high = (float(f(LEVEL / 2, z.size)) / z.size for f in (chi2.ppf, chi2.isf))
    sigmas = float(norm.isf(LEVEL / 2))
    ratio = float(stopped.std() / fixed.std())
    early = float(np.mean(took < LONGEST_S))
    console.print(
        f"{count} units, target {TARGET / units.DEG_PER_HOUR:g} deg/h of each gyro: fixed dwells of the same target "
        f"{plan.min():g} … {plan.max():g} s (mean {plan.mean():.1f} s), stopped ones {took.min():g} … {took.max():g} s "
        f"(mean {took.mean():.1f} s), longest {LONGEST_S:g} s."
    )
    console.print(
        f"Time saved against one dwell for all that serves the noisiest unit ({plan.max():g} s): "
        f"{100.0 * (1.0 - took.mean() / plan.max()):.0f} %; against the longest: "
        f"{100.0 * (1.0 - took.mean() / LONGEST_S):.0f} %."
    )
    # Eight innovations a channel at a level of 1e-3/3: at three times the noise one channel is seen in 89 %, one of
    # three in 99.9 %; at twice the noise in 47 and 85 %, which is printed and not judged.
    loud, twice = ([dwell(seed, scale)[3] for seed in range(min(count, 40))] for scale in (3.0, 2.0))
    share = float(np.mean(np.array(twice) < LONGEST_S))
    console.print(f"Dwells of twice the declared noise that the rule ended all the same: {share:.2f} of {len(twice)}.")
    return [
        Check("spread of stopped over fixed dwells", ratio, 1.0 - WITHIN, 1.0 + WITHIN),
        Check("mean of stopped dwells / its standard error", float(z.mean() * np.sqrt(z.size)), -sigmas, sigmas),
        Check(f"errors over claims, χ²/{z.size}", float(np.mean(z**2)), low, high),
        Check("dwells that the rule ended", early, 0.97, 1.0),
        Check(
            "dwells of three times the declared noise that it ended",
            float(np.mean(np.array(loud) < LONGEST_S)),
            0.0,
            0.1,
        ),
    ]


def procedures_hold(count: int, console: Console) -> bool:
    """Print each procedure's spreads with the rule and with fixed dwells; False where one differs by more."""
    light_bench.use()
    quiet = Console(stderr=True)
    rows: list[dwell_procedures.Compared] = []
    for name in dwell_procedures.PROCEDURES:
        found, told = dwell_procedures.compared(name, count, lambda seeds, of=name: track(seeds, of, console=quiet))
        rows += found
        console.print(told)
    console.print(dwell_procedures.table_of(rows))
    console.print(
        f"{count} units, target {dwell_procedures.TARGET_DEG_H:g} deg/h of each gyro's mean; interval: paired "
        "bootstrap over units; by the claims: root of the mean predicted variances of all units, rule over fixed."
    )
    return all(row.outcome != "no" for row in rows)


def main() -> int:
    """All of it, on the terminal."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--units", type=int, default=300)
    parser.add_argument("--procedure-units", type=int, default=300)
    options = parser.parse_args()
    if options.units < 100 or options.procedure_units < 10:
        parser.error("at least 100 units, and 10 for the procedures")
    console = Console(width=170)
    checks = checks_of(options.units, console)
    console.print(table_of(checks))
    held = procedures_hold(options.procedure_units, console) and all(c.passed for c in checks)
    console.print("[green]All within tolerance.[/green]" if held else "[red]FAILED[/red]")
    return 0 if held else 1


if __name__ == "__main__":
    sys.exit(main())
