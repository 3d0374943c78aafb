"""Monte Carlo of thermometers: offsets, slopes and the converter's lag against the truth; thesis 4.1's own regressor.

``python -m tests.validation.thermometers [--units N]``. Exit code 1 if anything lies outside the tolerance of the
sample. Each unit is drawn, with sensors that have slopes and lags of their own; the chamber is wrong as it is declared.
"""

import argparse
import os
import sys
from dataclasses import replace

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")  # before numpy: one thread

import numpy as np
from rich.console import Console
from rich.progress import track
from rich.table import Table
from scipy.stats import binom, chi2, norm

from procedures.analysis.thermal.cycle.runs import GYRO_SENSORS
from procedures.analysis.thermal.fit import fit_correction
from procedures.analysis.thermal.following import follow
from procedures.analysis.thermal.judgement import magnitude
from procedures.analysis.thermal.runs import ThermalRun, thermal_run
from simulators.chamber.plant import ChamberPlant
from simulators.chamber.thermometers import Thermometers
from simulators.truth import Array, keyed_generator
from simulators.truth.thermal import ChamberTruth, UnitThermalTruth, random_thermal_truth
from tests.validation.judgement import Check
from tests.validation.thermal import table_of
from tests.validation.thermal_population import runs_of
from tests.validation.thermal_rig import LAG_S, OTHER, THESIS_LIKE, Cycle, G, Leg, reference_c, stage_one
from tests.validation.thermal_rig import converter_bench as models_of
from tests.validation.thermometer_rig import compared

FAMILY_LEVEL = 1e-3
NAMES = tuple(
    f"{sensor} {of}" for sensor in ("case", "converter", "gyro x", "gyro y", "gyro z") for of in ("offset", "slope")
)
CHECKS = len(NAMES) + 1 + 2 * 3
LEVEL = FAMILY_LEVEL / CHECKS


def chi_square(name: str, statistic: float, freedom: int) -> Check:
    """A sum of squares of errors over claims, a degree of freedom: χ²/ν between the ends of its own distribution."""
    low, high = (float(f(LEVEL / 2, freedom)) / freedom for f in (chi2.ppf, chi2.isf))
    return Check(f"{name}: χ²/{freedom}", statistic / freedom, low, high)


def thermometer_checks(count: int) -> list[Check]:
    """Errors of ten numbers a unit with their whole covariance, and one by one."""
    total, each = 0.0, np.zeros(len(NAMES))
    for seed in track(range(count), "cold starts", console=Console(stderr=True)):
        c = compared(seed)
        total += float(c.error @ np.linalg.solve(c.covariance, c.error))
        each += c.error**2 / np.diag(c.covariance)
    found = [chi_square("offsets and slopes, whole covariance", total, 10 * count)]
    return found + [chi_square(name, float(v), count) for name, v in zip(NAMES, each, strict=True)]


def readings(truth: UnitThermalTruth, legs: list[Leg], seed: int) -> tuple[Array, Array]:
    """Readings of case and converter through a run, one a second."""
    plant = ChamberPlant(ChamberTruth(), truth.network, seed)
    plant.state.unit_on = True
    paths = []
    for leg in legs:
        plant.command(leg.target_c, leg.ramp_c_min / 60.0)
        paths.append(plant.run(leg.seconds))
    codes = Thermometers(truth.thermometers, seed, ChamberTruth().ambient_c).read(0, np.concatenate(paths))
    steps = [t.step_c for t in truth.thermometers]
    return codes[:, 0] * steps[0], codes[:, 1] * steps[1]


CASE_LAG_SD_S = 0.05


def lag_checks(count: int) -> list[Check]:
    """Board's delay, the converter sensor's lag between 2 and 10 s, and the sum that a ramp shows, of each unit.

    The case's lag is given to ±0.05 s, and drawn so. Besides χ², the count of errors beyond two standard uncertainties.
    """
    rows = []
    for seed in track(range(count), "converter's lag", console=Console(stderr=True)):
        rng, truth = keyed_generator(seed, "lag"), random_thermal_truth(seed)
        case_lag, lag = LAG_S + CASE_LAG_SD_S * float(rng.standard_normal()), float(rng.uniform(2.0, 10.0))
        sensors = list(truth.thermometers)
        sensors[0], sensors[1] = replace(sensors[0], lag_s=case_lag), replace(sensors[1], lag_s=lag)
        truth = replace(truth, thermometers=tuple(sensors))
        case, board = zip(*(readings(truth, THESIS_LIKE, 10 * seed + up) for up in range(3)), strict=True)
        found = follow(case, board, 1.0, LAG_S, CASE_LAG_SD_S)
        delay = truth.network.converter_j_k / truth.network.case_to_converter_w_k
        rows.append(
            (
                (found.delay_s - delay) / found.delay_sd_s,
                (found.sensor_lag_s - lag) / found.sensor_lag_sd_s,
                (found.total_delay_s - (delay + lag - case_lag)) / found.total_delay_sd_s,
            )
        )
    z = np.array(rows)
    names = ("board's delay", "converter sensor's lag", "delay of reading behind reading")
    checks = [chi_square(name, float(np.sum(z[:, i] ** 2)), count) for i, name in enumerate(names)]
    beyond = 2.0 * float(norm.sf(2.0))
    least, most = (float(f(LEVEL / 2, count, beyond)) / count for f in (binom.ppf, binom.isf))
    shares = np.mean(np.abs(z) > 2.0, axis=0)
    return checks + [Check(f"{n}: beyond 2 u", float(s), least, most) for n, s in zip(names, shares, strict=True)]


def by_gyros(run: Cycle, truth: UnitThermalTruth, output: Array) -> ThermalRun:
    """The same run with each axis' own gyro's thermometer as the static regressor (thesis 4.1)."""
    series = {
        "output": output,
        "case": run.codes[:, 0],
        "static": run.codes[:, GYRO_SENSORS],
        "converter": run.codes[:, 1],
    }
    lag = {"static": LAG_S, "converter": LAG_S}
    return thermal_run(run.up, G, 1.0, series, lag_s=lag, force_m_s2=run.force)


def regressors_table(units: int) -> Table:
    """|ĝ| on the cycle that was fitted and on another one, by the case and by each gyro's own thermometer."""
    columns = ("unit", "static terms by", "|ĝ| in soaks", "on ramps", "other cycle: in soaks", "on ramps")
    table = Table(*columns, title="thesis 4.1's regressor beside ours, rms of |ĝ| about its mean, m/s²")
    for seed in range(units):
        truth = UnitThermalTruth() if seed == 0 else random_thermal_truth(seed)
        both = []
        for legs, start in ((THESIS_LIKE, 5), (OTHER, 6)):
            cased, cycles = runs_of(truth, legs, start + 100 * seed)
            models = models_of(truth, start + 100 * seed)
            both.append((cased, [by_gyros(c, truth, stage_one(c, truth, models)) for c in cycles]))
        for k, name in enumerate(("the case", "own gyro")):
            correction, _ = fit_correction(both[0][k], reference_c(truth))
            cells: list[str] = []
            for runs in (both[0][k], both[1][k]):
                g = [magnitude(run, correction, G) for run in runs]
                both_regimes = [m.rms_static_m_s2 for m in g], [m.rms_dynamic_m_s2 for m in g]
                cells += [f"{np.sqrt(np.mean(np.square(values))):.3g}" for values in both_regimes]
            table.add_row("default" if seed == 0 else f"drawn {seed}", name, *cells)
    return table


def main() -> int:
    """All of it, on the terminal."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--units", type=int, default=100)
    parser.add_argument("--regressors", type=int, default=3, help="units of which the two regressors are compared")
    options = parser.parse_args()
    if options.units < 20:
        parser.error("at least 20 units")
    console = Console(width=150)
    checks = thermometer_checks(options.units) + lag_checks(options.units)
    console.print(table_of(checks), regressors_table(options.regressors))
    console.print(f"{options.units} units. Together the checks fail by chance with probability {FAMILY_LEVEL:g}.")
    failed = [c for c in checks if not c.passed]
    console.print("[red]FAILED[/red]" if failed else "[green]All within tolerance.[/green]")
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main())
