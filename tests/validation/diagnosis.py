"""Monte Carlo of the diagnosis: is the coefficient that moved named first, and none where nothing moved?

``python -m tests.validation.diagnosis [--units N] [--workers N]`` (``make validate``). Each simulated unit is
calibrated in one launch and verified in another, unchanged; then one coefficient of its truth, drawn among the 24 of
both triads, is changed by five standard uncertainties after all others are fitted, either way, and it is verified
again. Exit code 1 where the right one (or the group that the stations cannot tell apart) is named first in less than
90 %, or something is named of more than 5 % of the unchanged.
"""

import argparse
import multiprocessing
import os
import sys

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")  # before numpy: one thread a worker

from collections.abc import Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass, replace
from functools import partial

import numpy as np
from rich.console import Console
from rich.table import Table

from procedures.analysis.calibration.diagnosis import (
    TriadDiagnosis,
    coefficient_columns,
    inseparable,
    residual_covariance,
)
from procedures.analysis.calibration.reference import TRIAD_NAMES, reference_vectors
from procedures.analysis.calibration.station_noise import triad_covariance
from procedures.analysis.calibration.table_errors import table_errors
from procedures.analysis.calibration.triad_analysis import analyse_triad
from procedures.analysis.calibration.triad_verification import verify_triad
from procedures.core.imu_model import COEFFICIENT_NAMES
from procedures.core.recording import Station
from procedures.core.table_angles import TableAngles
from procedures.core.unit import Unit
from simulators.truth import Array, TriadTruth, UnitTruth, declared_unit, keyed_generator, random_unit_truth
from simulators.world import WorldConfig
from tests.validation.population import SCENARIOS, Scenario, plans, recordings, table_uncertainty
from tests.validation.theory import dwell_windows

RIGHT_MIN, QUIET_MIN = 0.90, 0.95
SIZE = 5.0


@dataclass(frozen=True)
class Case:
    """A kind of table and the stations of the verification; None: the procedure's nine."""

    title: str
    scenario: Scenario
    stations: tuple[Station, ...] | None = None


def _level_stations() -> tuple[Station, ...]:
    """Twelve level stations: gravity lies along y alone and ω_y is the same at all.

    So b_i and K_i2 stand for one another in both triads, and the accelerometers' K_i1 and K_i3 are not seen.
    """
    angles = [TableAngles(30.0 * i, 0.0, 0.0) for i in range(12)]
    return tuple(Station(i, f"outer={a.outer_deg:g}", a, None, 2.0, 70.0) for i, a in enumerate(angles))


CASES = (
    Case("ideal table, nine orientations", SCENARIOS[0]),
    Case(f"{SCENARIOS[2].title}, the same in both jobs, nine orientations", SCENARIOS[2]),
    Case("ideal table, twelve level stations about the outer axis", SCENARIOS[0], _level_stations()),
)


@dataclass(frozen=True)
class Trial:
    """Outcome of one unit."""

    quiet: bool
    """True if nothing was named before the change."""
    right: bool
    """True if the coefficient that moved, or its group, was named first."""
    members: int
    """Coefficients in the group of the changed one; 1: it stands alone."""


def trial(case: Case, index: int) -> Trial:
    """Calibrate, verify, change one coefficient, verify again."""
    seed = case.scenario.first_seed + 500_000 + index
    truth, bench, plan = random_unit_truth(seed), case.scenario.bench(seed), plans(case.scenario)
    config, declared = WorldConfig(truth, bench, seed), declared_unit(truth)
    site, uncertainty = bench.description.site, table_uncertainty(bench.description)
    taken = recordings(config, plan.calibration, 1)
    made = tuple(analyse_triad(taken, t, site, uncertainty, declared.triad(t)).calibration for t in TRIAD_NAMES)
    known = replace(declared, calibrations=made)
    stations = case.stations or plan.verification

    def diagnosed(of: UnitTruth, launch: int) -> tuple[TriadDiagnosis, ...]:
        taken = recordings(replace(config, unit=of), stations, launch)
        found = [verify_triad(taken, t, site, known, uncertainty).diagnosis for t in TRIAD_NAMES]
        return tuple(d for d in found if d is not None)

    before = diagnosed(truth, 2)
    sizes = [_after_others(t, known, config, stations) for t in TRIAD_NAMES]
    rng = keyed_generator(seed, "diagnosis")
    visible = [(t, k) for t in range(2) for k in range(12) if np.isfinite(sizes[t][k])]
    t, k = visible[int(rng.integers(len(visible)))]
    size = SIZE * float(sizes[t][k] * rng.choice([-1.0, 1.0]))
    after = diagnosed(_changed(truth, TRIAD_NAMES[t], k, size), 3)
    named = max((c for d in after for c in d.named), key=lambda c: abs(c.sigmas), default=None)
    right = named is not None and COEFFICIENT_NAMES[k] in named.coefficients and named in after[t].named
    members = next(len(c.coefficients) for c in before[t].changes if COEFFICIENT_NAMES[k] in c.coefficients)
    return Trial(not any(d.named for d in before), right, members)


def _after_others(triad: str, unit: Unit, config: WorldConfig, stations: Sequence[Station]) -> Array:
    """Standard uncertainty of each coefficient's change after all others outside its group, (12,); not seen: inf."""
    calibration, record, site = (
        unit.required_calibration(triad, "verify"),
        unit.triad(triad),
        config.bench.description.site,
    )
    assert record is not None
    angles = [s.angles for s in stations if s.angles is not None]
    vectors = reference_vectors(triad, angles, site)
    noise = triad_covariance(record, dwell_windows(config.bench, stations, config.rate_hz))
    assert noise is not None
    launch = 2.0 * record.launch_covariance(vectors @ calibration.matrix_array.T)
    table = table_errors(angles, vectors, table_uncertainty(config.bench.description), of_gravity=triad != "gyro")
    inverse = np.linalg.inv(np.linalg.cholesky(residual_covariance(calibration, vectors, noise, launch, table)))
    design = inverse @ coefficient_columns(vectors)
    found = np.full(12, np.inf)
    for group in inseparable(vectors):
        others = np.delete(design, list(group), axis=1)
        left = design - others @ np.linalg.lstsq(others, design, rcond=1e-9)[0]
        for k in group:
            length = float(np.linalg.norm(left[:, k]))
            found[k] = 1.0 / length if length > 1e-6 * np.linalg.norm(design[:, k]) else np.inf
    return found


def _changed(truth: UnitTruth, triad: str, k: int, size: float) -> UnitTruth:
    """Copy a unit with one coefficient changed."""
    own: TriadTruth = truth.triad(triad)
    values = np.column_stack([own.bias, own.matrix]).ravel()
    values[k] += size
    rows = values.reshape(3, 4).tolist()
    bias, matrix = tuple(r[0] for r in rows), tuple(tuple(r[1:]) for r in rows)
    return replace(truth, **{triad: replace(own, bias=bias, matrix=matrix)})


def main() -> int:
    """All cases, one after the other."""
    parser = argparse.ArgumentParser(description="Monte Carlo of the diagnosis")
    parser.add_argument("--units", type=int, default=500, help="simulated units a case (at least 20)")
    parser.add_argument("--workers", type=int, default=min(2, os.cpu_count() or 1))
    options = parser.parse_args()
    if options.units < 20 or options.workers < 1:
        parser.error("at least 20 units and one worker")
    shown = Table("verification", "units", "named first", "of groups", "nothing named of the unchanged", "")
    held = True
    for case in CASES:
        with ProcessPoolExecutor(options.workers, multiprocessing.get_context("spawn")) as pool:
            trials = list(pool.map(partial(trial, case), range(options.units), chunksize=5))
        right, quiet = np.mean([t.right for t in trials]), np.mean([t.quiet for t in trials])
        grouped = [t.right for t in trials if t.members > 1]
        of_groups = f"{sum(grouped)} of {len(grouped)}" if grouped else "–"
        passed = bool(right >= RIGHT_MIN and quiet >= QUIET_MIN)
        held = held and passed
        figures = (f"{100 * right:.1f} %", of_groups, f"{100 * quiet:.1f} %", "OK" if passed else "FAIL")
        shown.add_row(case.title, str(len(trials)), *figures)
    console = Console(width=150)
    console.print(shown)
    console.print(
        f"Changes of {SIZE:g} σ after all others are fitted; at least {100 * RIGHT_MIN:g} % of them are to be"
    )
    console.print(f"named first, and nothing of at least {100 * QUIET_MIN:g} % of the unchanged units.")
    return 0 if held else 1


if __name__ == "__main__":
    sys.exit(main())
