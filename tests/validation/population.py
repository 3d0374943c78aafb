"""Many simulated units, each calibrated and then verified at another launch by the procedures' own analysis."""

import multiprocessing
from collections.abc import Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass, fields, replace
from functools import cache, partial

import numpy as np

from procedures.analysis.calibration.estimator import Weighting
from procedures.analysis.calibration.plan import TriadPlan, triad_plan
from procedures.analysis.calibration.reference import TRIAD_NAMES
from procedures.analysis.calibration.station_means import BATCHES
from procedures.analysis.calibration.table_errors import TableUncertainty
from procedures.analysis.calibration.triad_analysis import analyse_triad
from procedures.analysis.calibration.triad_verification import planned_covariance, verify_triad
from procedures.analysis.calibration.verification import predicted_sd
from procedures.bench.description import BenchDescription, TableAccuracy
from procedures.catalog import discover
from procedures.core.imu_model import TriadCalibration
from procedures.core.recording import ACCELEROMETER, GYRO, Channel, MemoryRecording, Quantity, RecordingInfo, Station
from procedures.procedure import Context
from simulators.dwell_means import DwellMeans, dwell_means
from simulators.truth import (
    Array,
    BenchTruth,
    TableTruth,
    declared_unit,
    default_bench,
    random_table_truth,
    random_unit_truth,
)
from simulators.world import WorldConfig, launch_truth
from tests.validation.theory import Reference, bounds, dwell_covariance, dwell_windows, reference

CALIBRATION = discover()["calibration_12_orientations"]
VERIFICATION = discover()["verification_9_orientations"]
CHANNELS = (
    *(Channel(name, Quantity.ANGULAR_RATE, "rad/s") for name in GYRO),
    *(Channel(name, Quantity.SPECIFIC_FORCE, "m/s^2") for name in ACCELEROMETER),
)


@dataclass(frozen=True)
class Scenario:
    """A kind of table: the spreads its laboratory declares, from which each unit's table is drawn [arcsec].

    The flaws drawn are `true_flaws` times what is declared.
    """

    title: str
    first_seed: int
    orthogonality: float = 0.0
    azimuth: float = 0.0
    pointing: float = 0.0
    level: float = 0.0
    weighting: Weighting = "noise_and_table"
    true_flaws: float = 1.0

    def bench(self, seed: int | None = None) -> BenchTruth:
        """The declared bench with a table drawn from its own accuracy, or with an ideal one."""
        site = replace(default_bench().description.site, azimuth_sd_arcsec=self.azimuth)
        accuracy = TableAccuracy(self.orthogonality, self.pointing, self.level)
        description = replace(default_bench().description, site=site, accuracy=accuracy)
        flaws = np.array([self.orthogonality, self.azimuth, self.pointing, self.level]) * self.true_flaws
        table = TableTruth() if seed is None else random_table_truth(seed, *flaws.tolist())
        return BenchTruth(default_bench().site, table, description)


SCENARIOS = (
    Scenario("ideal table", 1_000_000),
    Scenario("axes 3″, azimuth 5″", 2_000_000, orthogonality=3.0, azimuth=5.0),
    Scenario("axes 3″, azimuth 5″, pointing 1″, level 1″", 3_000_000, 3.0, 5.0, 1.0, 1.0),
)
"""The default weighting, which is to reach the joint bound."""
THESIS = replace(SCENARIOS[2], title="noise's weights, " + SCENARIOS[2].title, first_seed=4_000_000, weighting="noise")
"""The thesis's least squares, which is to reach its own bound."""
COARSE = Scenario("axes 3″, azimuth 10″, pointing 5″, level 3″", 5_000_000, 3.0, 10.0, 5.0, 3.0)
MISDECLARED = (
    *(replace(s, title=s.title + ": true flaws 5×", true_flaws=5.0) for s in (SCENARIOS[1], SCENARIOS[2], COARSE)),
    *(replace(s, title=s.title + ": true flaws none", true_flaws=0.0) for s in (SCENARIOS[1], SCENARIOS[2], COARSE)),
)
"""Tables that are not as they are declared."""


@dataclass(frozen=True)
class Outcome:
    """Outcome of one unit, or of many with one more axis in front. 24: coefficients of both triads; 2: triads."""

    errors: Array
    """Estimates minus the launch's truth, (24,)."""
    claimed: Array
    """Standard uncertainties of the result, (24,)."""
    bound: Array
    """Of the scenario's weighting: the joint one of noise and table, else the weighted one, (24,)."""
    noise_bound: Array
    weighted_bound: Array
    joint_bound: Array
    preview: Array
    """Predicted for the unit as it is once it has a calibration, (24,)."""
    first_preview: Array
    """Predicted for the same unit never calibrated before: K is taken for the identity, (24,)."""
    chi_square: Array
    """Of the calibration's residuals over their degrees of freedom, (2,)."""
    residual_degrees: Array
    p_value: Array
    verification_chi_square: Array
    """Of the verification's errors over their number, (2,)."""
    verification_degrees: Array
    verification_p_value: Array
    spread: Array
    """Sample variance of the corrected magnitudes over its prediction, (2,)."""
    spread_degrees: Array
    """Degrees of freedom of a chi-square with the variance that this ratio should have, (2,)."""


@dataclass(frozen=True)
class Plans:
    """Plans that every unit of a scenario has: stations, their plans for both triads, and the reference."""

    calibration: tuple[Station, ...]
    verification: tuple[Station, ...]
    to_calibrate: list[TriadPlan]
    to_verify: list[TriadPlan]
    seen: Reference


@cache
def plans(scenario: Scenario) -> Plans:
    """Made from the procedures' own defaults for a unit of the kind."""
    bench = scenario.bench()
    unit = declared_unit(random_unit_truth(0))
    context = Context(unit, bench.description)
    here, there = (p.schedule(p.resolve(p.params(), context)) for p in (CALIBRATION, VERIFICATION))
    d = bench.description
    axes = [(axis.rate_deg_s, axis.acceleration_deg_s2) for axis in (d.outer, d.middle, d.inner)]
    return Plans(
        here,
        there,
        [triad_plan(name, unit, here, axes, d.site, table_uncertainty(d), scenario.weighting) for name in TRIAD_NAMES],
        [triad_plan(name, unit, there, axes, d.site, TableUncertainty()) for name in TRIAD_NAMES],
        reference(bench, here),
    )


def one_unit(scenario: Scenario, index: int) -> Outcome:
    """Draw a unit and a table, calibrate in launch 1, verify in launch 2."""
    seed = scenario.first_seed + index
    truth, bench, plan = random_unit_truth(seed), scenario.bench(seed), plans(scenario)
    config, declared = WorldConfig(truth, bench, seed), declared_unit(truth)
    site, uncertainty = bench.description.site, table_uncertainty(bench.description)

    taken = recordings(config, plan.calibration, 1)
    weights = scenario.weighting
    fits = [
        analyse_triad(taken, name, site, uncertainty, declared.triad(name), weighting=weights) for name in TRIAD_NAMES
    ]
    made = [f.calibration for f in fits]
    known = replace(declared, calibrations=tuple(made))
    taken = recordings(config, plan.verification, 2)
    verified = [verify_triad(taken, name, site, known) for name in TRIAD_NAMES]
    again = [replace(p, unit=known, matrix=c.matrix_array) for p, c in zip(plan.to_verify, made, strict=True)]
    expected = [c for c in map(planned_covariance, again) if c is not None]

    true = [launch_truth(config, 1)[name] for name in TRIAD_NAMES]
    windows = dwell_windows(bench, plan.calibration, config.rate_hz)
    noise = (dwell_covariance(truth.gyro, windows), dwell_covariance(truth.accelerometer, windows))
    allowed = bounds(plan.seen, noise, (true[0][1], true[1][1]))
    pairs = [previewed(replace(p, unit=declared), c) for p, c in zip(plan.to_calibrate, made, strict=True)]
    preview, first_preview = np.concatenate(pairs, axis=1)
    spread = [v.magnitudes.sd_after**2 / predicted_sd(c) ** 2 for v, c in zip(verified, expected, strict=True)]
    return Outcome(
        np.concatenate([c.coefficients for c in made]) - np.concatenate([np.column_stack(t).ravel() for t in true]),
        np.concatenate([c.standard_uncertainties for c in made]),
        allowed.weighted if weights == "noise" else allowed.joint,
        allowed.noise,
        allowed.weighted,
        allowed.joint,
        preview,
        first_preview,
        np.array([f.chi_square / f.degrees_of_freedom for f in fits]),
        np.array([f.degrees_of_freedom for f in fits], dtype=np.float64),
        np.array([f.p_value for f in fits], dtype=np.float64),
        np.array([v.chi_square for v in verified], dtype=np.float64) / len(plan.verification),
        np.full(len(verified), len(plan.verification), dtype=np.float64),
        np.array([v.p_value for v in verified], dtype=np.float64),
        np.array(spread),
        np.array([spread_degrees(c) for c in expected]),
    )


def previewed(plan: TriadPlan, calibration: TriadCalibration) -> Array:
    """Predicted standard uncertainties of a triad with a calibration and of one without, (2, 12)."""
    noise = plan.noise_covariance()
    assert noise is not None
    cases = []
    for case in (replace(plan, matrix=calibration.matrix_array), plan):
        gls = case.estimator(noise)
        cases.append(np.sqrt(np.diagonal(gls.noise_covariance) + np.diagonal(case.share(gls).covariance)))
    return np.array(cases)


def recordings(config: WorldConfig, stations: Sequence[Station], launch: int) -> list[MemoryRecording]:
    """Stations' means as the shortest recordings that have them: every sample of a station is its mean."""
    means: DwellMeans = dwell_means(config, stations, launch)
    starts = dwell_windows(config.bench, stations, config.rate_hz)[:, 0].tolist()
    rows = np.column_stack([means.gyro, means.accelerometer])
    return [
        MemoryRecording(
            RecordingInfo(s.label, config.unit.serial, CHANNELS, BATCHES / s.record_s, BATCHES, start, s),
            np.tile(row, (BATCHES, 1)),
        )
        for s, start, row in zip(stations, starts, rows, strict=True)
    ]


def table_uncertainty(bench: BenchDescription) -> TableUncertainty:
    """Uncertainty that a bench declares, as the analysis takes it."""
    a = bench.accuracy
    sds = (a.orthogonality_sd_arcsec, a.pointing_sd_arcsec, a.level_sd_arcsec, bench.site.azimuth_sd_arcsec)
    return TableUncertainty(*sds, bench.site.gravity_sd_m_s2 / bench.site.gravity_m_s2)


def spread_degrees(covariance: Array) -> float:
    """``(tr MC)²/tr(MC)²``, M the projection off the mean: the effective degrees of freedom of a sample variance."""
    centred = covariance - covariance.mean(axis=0)
    return float(np.trace(centred) ** 2 / np.trace(centred @ centred))


def population(scenario: Scenario, units: int, workers: int = 1) -> Iterator[Outcome]:
    """Unit after unit, the same whatever the number of workers."""
    if workers == 1:
        yield from map(partial(one_unit, scenario), range(units))
        return
    with ProcessPoolExecutor(workers, multiprocessing.get_context("spawn")) as pool:
        yield from pool.map(partial(one_unit, scenario), range(units), chunksize=5)


def stacked(outcomes: Sequence[Outcome]) -> Outcome:
    """All of them, units first."""
    return Outcome(*(np.array([getattr(o, f.name) for o in outcomes]) for f in fields(Outcome)))
