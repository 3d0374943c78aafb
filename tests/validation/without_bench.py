"""Monte Carlo of the methods that need no bench: error growth, field calibration, better orientations.

``python -m tests.validation.without_bench [--units N]`` (``make validate``). Exit code 1 if anything lies outside the
tolerance of the sample: together the checks fail by chance once in a thousand runs.
"""

import argparse
import os
import sys
from collections.abc import Callable, Sequence

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")  # before numpy

import numpy as np
from rich.console import Console
from rich.table import Table as ScreenTable
from scipy.spatial.transform import Rotation
from scipy.stats import binom

from procedures.analysis.calibration.multiposition import fit_triad
from procedures.analysis.calibration.reference import reference_vectors
from procedures.analysis.calibration.station_noise import triad_covariance
from procedures.analysis.calibration.station_plan import windows
from procedures.analysis.calibration.table_errors import TableUncertainty, table_errors
from procedures.analysis.field.fit import FieldModel, FieldUncertainty, fit_field
from procedures.analysis.navigation.error_growth import Alignment, error_growth
from procedures.analysis.navigation.error_model import Place
from procedures.analysis.navigation.growth_summary import radius_95
from procedures.analysis.navigation.instrument_errors import TriadErrors
from procedures.analysis.orientation_plan import comparison
from procedures.core import units as u
from procedures.core.noise import NoiseCoefficients
from procedures.core.table_angles import TableAngles
from procedures.core.unit import TriadRecord, Unit
from procedures.methods.plan_orientations import METHOD as PLAN
from procedures.procedure import Evidence
from tests.kit.forward_model import ACCELEROMETER_NOISE, GYRO_NOISE, K_GYRO, SITE, random_table, turn
from tests.validation.judgement import FAMILY_LEVEL, LEVEL, Check, spread_limits

G, R, EARTH, LATITUDE = 9.81, 6_371_000.0, u.EARTH_RATE, np.radians(50.45)
GYRO_BIAS, ACCELEROMETER_BIAS = 0.01 * u.DEG_PER_HOUR, 5e-4
GYRO_N, ACCELEROMETER_N = 0.003 * u.DEG_PER_SQRT_HOUR, 2e-5
ALIGNING_S, STEP_S = 600.0, 10.0
UNIT = Unit("S-1", 400.0, (), TriadRecord((GYRO_NOISE,) * 3), TriadRecord((ACCELEROMETER_NOISE,) * 3))


def navigate(units: int, rng: np.random.Generator, duration_s: float = 3600.0) -> np.ndarray:
    """Metres north and east (units, 2) that parked navigators on a sphere are off, nonlinear equations by Runge-Kutta.

    Each aligns itself from means with its biases and noise (pitch and roll from f, heading from the level rate), then
    integrates attitude matrix, velocity and place with noise anew in every step. Height is held.
    """
    bias = np.hstack([rng.normal(size=(units, 3)) * GYRO_BIAS, rng.normal(size=(units, 3)) * ACCELEROMETER_BIAS])
    densities = np.repeat([GYRO_N, ACCELEROMETER_N], 3)
    truth = np.array([EARTH * np.cos(LATITUDE), EARTH * np.sin(LATITUDE), 0.0, 0.0, G, 0.0])
    seen = truth + bias + rng.normal(size=(units, 6)) * densities / np.sqrt(ALIGNING_S)
    rate, force = seen[:, :3], seen[:, 3:]
    pitch = np.arctan2(force[:, 0], np.hypot(force[:, 1], force[:, 2]))
    roll = np.arctan2(-force[:, 2], force[:, 1])
    level = Rotation.from_euler("ZX", np.column_stack([pitch, roll])).apply(rate)
    heading = np.arctan2(-level[:, 2], level[:, 0])
    state = (
        Rotation.from_euler("YZX", np.column_stack([-heading, pitch, roll])).as_matrix(),
        np.zeros((units, 3)),
        np.tile([LATITUDE, 0.0], (units, 1)),
    )
    for _ in range(round(duration_s / STEP_S)):
        now = truth + bias + rng.normal(size=(units, 6)) * densities / np.sqrt(STEP_S)
        state = _stepped(state, now)
    place = state[2] - np.array([LATITUDE, 0.0])
    return R * place * np.array([1.0, np.cos(LATITUDE)])


State = tuple[np.ndarray, np.ndarray, np.ndarray]


def _stepped(state: State, seen: np.ndarray) -> State:
    """Runge and Kutta's fourth order over one step; seen (units, 6) is constant in it."""

    def moved(by: State, h: float) -> State:
        return state[0] + h * by[0], state[1] + h * by[1], state[2] + h * by[2]

    k1 = _derivative(state, seen)
    k2 = _derivative(moved(k1, STEP_S / 2), seen)
    k3 = _derivative(moved(k2, STEP_S / 2), seen)
    k4 = _derivative(moved(k3, STEP_S), seen)
    mean = tuple((a + 2 * b + 2 * c + d) / 6 for a, b, c, d in zip(k1, k2, k3, k4, strict=True))
    return moved((mean[0], mean[1], mean[2]), STEP_S)


def _cross(v: np.ndarray) -> np.ndarray:
    matrix = np.zeros((len(v), 3, 3))
    matrix[:, 0, 1], matrix[:, 0, 2], matrix[:, 1, 2] = -v[:, 2], v[:, 1], -v[:, 0]
    return matrix - matrix.transpose(0, 2, 1)


def _derivative(state: State, seen: np.ndarray) -> State:
    attitude, velocity, place = state
    latitude = place[:, 0]
    none = np.zeros_like(latitude)
    earth = EARTH * np.column_stack([np.cos(latitude), np.sin(latitude), none])
    over = np.column_stack([velocity[:, 2], velocity[:, 2] * np.tan(latitude), -velocity[:, 0]]) / R
    dc = attitude @ _cross(seen[:, :3]) - _cross(earth + over) @ attitude
    dv = (attitude @ seen[:, 3:, None])[:, :, 0] - np.cross(2 * earth + over, velocity)
    dv[:, 1] = 0.0
    return dc, dv, np.column_stack([velocity[:, 0], velocity[:, 2] / np.cos(latitude)]) / R


def growth(units: int) -> list[Check]:
    """Predicted spread and 95 % radius after one hour against navigators that went off."""
    drawn = navigate(units, np.random.default_rng(1))
    place = Place(LATITUDE, G, EARTH)
    gyro = TriadErrors({"b": np.eye(3) * GYRO_BIAS**2}, (NoiseCoefficients(random_walk=GYRO_N),) * 3)
    force = TriadErrors({"b": np.eye(3) * ACCELEROMETER_BIAS**2}, (NoiseCoefficients(random_walk=ACCELEROMETER_N),) * 3)
    predicted = error_growth(place, np.eye(3), gyro, force, Alignment(ALIGNING_S), 3600.0).total[-1]
    sd = np.sqrt(np.diagonal(place.metres @ predicted @ place.metres.T))
    limits = spread_limits(units)
    found = [
        Check(f"growth: spread {name} after 1 h ({s:.0f} m) / predicted", float(column.std(ddof=1) / s), *limits)
        for name, column, s in zip(("north", "east"), drawn.T, sd, strict=True)
    ]
    inside = float(np.mean(np.linalg.norm(drawn, axis=1) <= radius_95(place, predicted)))
    low, high = (float(f(LEVEL / 2, units, 0.95)) / units for f in (binom.ppf, binom.isf))
    return [*found, Check("growth: inside the 95 % radius", inside, low, high)]


FIELD = {
    "two, level": (((0, 0), (45, 5)), False),
    "F's five, turn zeros": (((0, 0), (22.5, 0), (22.5, 2.5), (45, 2.5), (45, 5)), True),
    "six wide, turn zeros": (((0, 0), (45, 0), (45, 45), (90, 45), (0, 90), (-60, -60)), True),
}


def field(units: int) -> list[Check]:
    """Errors of F's positions over what is claimed: everything that is declared uncertain is drawn anew."""
    found: list[Check] = []
    for title, (listed, estimate) in FIELD.items():
        positions, rng = np.array(listed, dtype=float), np.random.default_rng(2)
        angle, noise, cross, level = 60 * u.ARCSEC, 5e-5, 1e-4, 0.0 if estimate else 60 * u.ARCSEC
        declared = FieldUncertainty(angle, ((level**2, 0.0), (0.0, level**2)), 0.0, cross)
        model = FieldModel(np.radians(positions), np.array([0, G, 0]), "turn_zeros" if estimate else "base", estimate)
        covariance = np.array([np.eye(len(positions)) * noise**2] * 3)
        errors = np.empty((units, 6))
        for i in range(units):
            off = np.degrees(rng.normal(size=2) * (0.01 if estimate else level))
            actual = positions + np.degrees(rng.normal(size=positions.shape) * angle)
            up = np.array([0.0, G, 0.0])
            if estimate:
                actual = actual + off
            else:
                up = turn("x", off[1]).T @ turn("z", off[0]).T @ up
            vectors = np.array([turn("x", b).T @ turn("z", a).T @ up for a, b in actual])
            couplings = np.eye(3) + cross * rng.normal(size=(3, 3)) * (1 - np.eye(3))
            outputs = vectors @ couplings.T + noise * rng.normal(size=vectors.shape)
            fit = fit_field(title, outputs, covariance, model, declared)
            errors[i] = np.concatenate([fit.bias, fit.scale - 1.0]) / np.sqrt(np.diagonal(fit.covariance)[:6])
        names = [f"{kind} {axis}" for kind in ("bias", "scale") for axis in "xyz"]
        found += [
            Check(f"field, {title}: {name}, spread / claimed", float(column.std(ddof=1)), *spread_limits(units))
            for name, column in zip(names, errors.T, strict=True)
        ]
    return found


def orientations(units: int) -> list[Check]:
    """The recommended orientations beside the thesis's twelve, on tables with flaws: spread of the scale factors."""
    site = {"latitude_deg": SITE.latitude_deg, "gravity_m_s2": SITE.gravity_m_s2, "azimuth_deg": SITE.azimuth_deg}
    result = PLAN.analyse(Evidence(), PLAN.params(**site), UNIT)
    found: list[Check] = []
    worst: list[float] = []
    for plan in (result.plans[0], result.plans[result.recommended]):
        angles = [TableAngles(*row) for row in plan.orientations_deg]
        errors, claimed = _calibrated(angles, plan.dwell_s, units)
        spread = errors.std(axis=0, ddof=1)
        found += [
            Check(f"{plan.name}: {name}, spread / claimed", float(spread[k] / claimed[k]), *spread_limits(units))
            for name, k in (("K11", 1), ("K22", 6), ("K33", 11))
        ]
        worst.append(float(spread[[1, 6, 11]].max()))
    low, high = spread_limits(units)
    ratio = plan.improvement
    found.append(
        Check(f"worst scale factor, spread of 12 / of {len(angles)}", worst[0] / worst[1], ratio * low, ratio * high)
    )
    return [*found, Check("improvement predicted", ratio, 1.3, np.inf)]


def _calibrated(angles: Sequence[TableAngles], dwell_s: float, units: int) -> tuple[np.ndarray, np.ndarray]:
    """Errors (units, 12) of gyro calibrations on tables drawn anew, and what is claimed, (12,)."""
    rng, stations = np.random.default_rng(3), comparison.stations(angles, dwell_s, 2.0)
    covariance = triad_covariance(UNIT.gyro, windows(stations, ((60.0, 100.0),) * 3))
    assert covariance is not None
    vectors = reference_vectors("gyro", angles, SITE)
    table = table_errors(angles, vectors, TableUncertainty(3.0, 1.0, 1.0, 5.0), of_gravity=False)
    truth = np.column_stack([np.zeros(3), K_GYRO]).ravel()
    errors, claimed = np.empty((units, 12)), np.empty(12)
    for i in range(units):
        bench = random_table(rng, 3.0, 1.0, 1.0, 5.0)
        seen = np.array([bench.vectors(s, SITE)[0] for s in stations])
        noise = np.column_stack([np.linalg.cholesky(c) @ rng.normal(size=len(stations)) for c in covariance])
        fit = fit_triad("gyro", "rad/s", "rad/s", vectors, seen @ K_GYRO.T + noise, covariance, table)
        errors[i], claimed = fit.coefficients - truth, np.sqrt(np.diagonal(fit.covariance))
    return errors, claimed


PARTS: dict[str, tuple[Callable[[int], list[Check]], int]] = {
    "error growth": (growth, 1),
    "field calibration": (field, 4),
    "better orientations": (orientations, 1),
}
"""What is drawn, and for one in how many of the units asked for."""


def main() -> int:
    """All parts, one after the other."""
    parser = argparse.ArgumentParser(description="Monte Carlo of the methods that need no bench")
    parser.add_argument("--units", type=int, default=1000, help="drawn units a part (at least 100)")
    options = parser.parse_args()
    if options.units < 100:
        parser.error("at least 100 units")
    console, failed = Console(width=150), False
    for title, (part, share) in PARTS.items():
        table = ScreenTable("figure", "value", "allowed", "", title=title)
        for c in part(options.units // share):
            table.add_row(c.name, f"{c.value:.4f}", f"{c.low:.3g} … {c.high:.3g}", "OK" if c.passed else "FAIL")
            failed |= not c.passed
        console.print(table)
    console.print(f"Together the checks fail by chance with a probability of less than {FAMILY_LEVEL:g}.")
    console.print("[red]FAILED[/red]" if failed else "[green]All within tolerance.[/green]")
    return int(failed)


if __name__ == "__main__":
    sys.exit(main())
