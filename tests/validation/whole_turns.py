"""Monte Carlo of whole turns: are the errors of the scale factors what is claimed, and what the preview promised?

``python -m tests.validation.whole_turns [--units N] [--stepped N]``. Exit code 1 if anything lies outside the tolerance
of the sample. Two kinds of unit: many whose stations' integrals are made in closed form from the truth, with the same
noise as the full path; and a few that are turned step by step on the simulated bench, asymmetric and nonlinear.
"""

import argparse
import asyncio
import os
import sys
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")  # before numpy: one thread

import numpy as np
from rich.console import Console
from rich.progress import track
from rich.table import Table
from scipy.stats import chi2, kstest, norm

from procedures.analysis.turns.plan import coefficient_names
from procedures.analysis.turns.summary import WholeTurns
from procedures.bench.description import TableAccuracy
from procedures.catalog.scale_factor_whole_turns import PROCEDURE
from procedures.core import units
from procedures.core.recording import GYRO, Channel, MemoryRecording, Quantity, RecordingInfo, Station
from procedures.procedure import Context
from simulators.imu.sensor import station_means
from simulators.truth import (
    Array,
    BenchTruth,
    UnitTruth,
    declared_unit,
    default_bench,
    random_table_truth,
    random_unit_truth,
)
from simulators.turntable.kinematics import at_rest, attitude, base_attitude
from simulators.turntable.profile import Spin
from simulators.world import WorldConfig, build, launch_truth

PARAMS = PROCEDURE.params()
NAMES = coefficient_names(PARAMS.terms)
LEVEL = 1e-3 / (4 * len(NAMES) + 6)
"""Two populations, two figures a coefficient and three more each: all together fail by chance once in a thousand."""
CHANNELS = tuple(Channel(name, Quantity.ANGULAR_RATE, "rad/s") for name in GYRO)
SAMPLES = 20
PER_TURN = 720
"""Steps a turn for the Earth's turn, by trapezoid: to 1e-5 of some arcseconds."""
EVEN_PPM = (40.0, -30.0, 20.0), (-25.0, 15.0, 30.0)
"""Asymmetry, and quadratic term at the fastest rate, of the stepped units."""


@dataclass(frozen=True)
class Outcome:
    """Outcome of one unit: errors, claims, preview of the coefficients (k,), chi-square over its degrees, p-value."""

    errors: Array
    claimed: Array
    previewed: Array
    chi_square: float
    degrees: int
    p_value: float


def bench(seed: int, accuracy: TableAccuracy) -> BenchTruth:
    """The default bench with a table drawn from its declared accuracy."""
    a = accuracy
    table = random_table_truth(seed, a.orthogonality_sd_arcsec, 5.0, a.pointing_sd_arcsec, a.level_sd_arcsec)
    shipped = default_bench()
    return BenchTruth(shipped.site, table, replace(shipped.description, accuracy=accuracy))


def mean_inputs(made: BenchTruth, stations: Sequence[Station], rng: np.random.Generator) -> Array:
    """True mean angular rate of each station in the unit's axes, (n, 3) [rad/s], pointing errors drawn anew."""
    rows = []
    for station in stations:
        turn, angles = station.turn, station.angles
        assert turn is not None
        assert angles is not None
        errors = rng.standard_normal(4) * made.table.pointing_sd_arcsec * units.ARCSEC
        start = units.DEG * np.array([angles.outer_deg, angles.middle_deg, angles.inner_deg]) + errors[:3]
        angle = units.DEG * turn.angle_deg + errors[3] - errors[0]
        spin = Spin(start, 0, angle, turn.duration_s, turn.ramp_s)
        times = np.linspace(0.0, station.record_s, PER_TURN * abs(turn.turns) + 1)
        azimuth = made.description.site.azimuth_deg
        earth = at_rest(attitude(spin.at(times)[0], made.table, azimuth), made.site)[0]
        trapezoid = (earth.sum(axis=0) - 0.5 * (earth[0] + earth[-1])) / (len(times) - 1)
        here = attitude(start[None], made.table, azimuth)[0]
        axis = here.T @ base_attitude(made.table, azimuth)[:, 1]
        rows.append(trapezoid + axis * angle / station.record_s)
    return np.array(rows)


def recordings(config: WorldConfig, stations: Sequence[Station]) -> list[MemoryRecording]:
    """The shortest recordings with the stations' means: every sample is the mean, give or take a ripple."""
    inputs = mean_inputs(config.bench, stations, np.random.Generator(np.random.Philox(config.seed)))
    gaps = np.array([s.record_s for s in stations]) + 5.0
    starts = 10.0 + np.concatenate([[0.0], np.cumsum(gaps)[:-1]])
    ticks = np.round(np.column_stack([starts, starts + gaps - 5.0]) * config.rate_hz)
    means = station_means(config.unit.gyro, config.rate_hz, (config.seed, 1, "gyro"), ticks, inputs)
    ripple = np.where(np.arange(SAMPLES) % 2, 1e-9, -1e-9)[:, None]
    spans = (ticks[:, 1] - ticks[:, 0]) / config.rate_hz
    return [
        MemoryRecording(
            RecordingInfo(s.label, config.unit.serial, CHANNELS, SAMPLES / span, SAMPLES, tick / config.rate_hz, s),
            row + ripple,
        )
        for s, span, tick, row in zip(stations, spans.tolist(), ticks[:, 0].tolist(), means, strict=True)
    ]


async def _stepped(config: WorldConfig, stations: Sequence[Station]) -> list[MemoryRecording]:
    world, made = build(config), []
    async for stream in PROCEDURE.acquire(world, stations):
        raw = np.concatenate([block async for block in stream.blocks])
        info = RecordingInfo(
            f"{len(made)}",
            config.unit.serial,
            stream.channels,
            stream.rate_hz,
            len(raw),
            stream.start_s,
            stream.station,
            launched_s=stream.launched_s,
        )
        made.append(MemoryRecording(info, raw))
    return made


def judged(config: WorldConfig, stepped: bool = False) -> Outcome:
    """One unit from its truth to its errors."""
    context = Context(declared_unit(config.unit), config.bench.description)
    params = PROCEDURE.resolve(PARAMS, context)
    stations = PROCEDURE.schedule(params)
    taken = asyncio.run(_stepped(config, stations)) if stepped else recordings(config, stations)
    found: WholeTurns = PROCEDURE.analyse(taken, params, context).gyro
    bias, matrix = launch_truth(config)["gyro"]
    gyro = config.unit.gyro
    at_reference = max(params.rates_deg_s) * units.DEG / gyro.nonlinearity_reference
    true = np.column_stack(
        [
            np.column_stack([bias, matrix]),
            np.array(gyro.scale_factor_asymmetry_ppm) * units.PPM,
            np.array(gyro.scale_factor_nonlinearity_ppm) * units.PPM * at_reference,
            np.zeros(3),
        ]
    )
    promised = {u.name: u.standard_uncertainty for u in PROCEDURE.predict(params, context).uncertainties}
    assert found.p_value is not None
    return Outcome(
        np.array([c.estimate for c in found.coefficients]) - true.ravel(),
        np.array([c.standard_uncertainty for c in found.coefficients]),
        np.array([promised[c.name] for c in found.coefficients]),
        found.chi_square / found.degrees_of_freedom,
        found.degrees_of_freedom,
        found.p_value,
    )


def uneven(unit: UnitTruth) -> UnitTruth:
    """The unit with asymmetric and nonlinear gyros."""
    asymmetry, quadratic = EVEN_PPM
    fastest = max(PARAMS.rates_deg_s) * units.DEG
    gyro = replace(
        unit.gyro,
        scale_factor_asymmetry_ppm=asymmetry,
        scale_factor_nonlinearity_ppm=quadratic,
        nonlinearity_reference=fastest,
    )
    return replace(unit, gyro=gyro)


def population(first_seed: int, count: int, accuracy: TableAccuracy) -> Iterator[Outcome]:
    """Unit after unit, each on a table of its own."""
    for seed in range(first_seed, first_seed + count):
        yield judged(WorldConfig(random_unit_truth(seed), bench(seed, accuracy), seed))


def show(title: str, outcomes: Sequence[Outcome], console: Console) -> list[str]:
    """Print a population; a sentence for each figure outside what its size allows."""
    errors, claimed = (np.array([getattr(o, f) for o in outcomes]) for f in ("errors", "claimed"))
    previewed, n = np.array([o.previewed for o in outcomes]), len(outcomes)
    z = errors / claimed
    low, high = (float(np.sqrt(f(LEVEL / 2, n) / n)) for f in (chi2.ppf, chi2.isf))
    largest = float(norm.isf(LEVEL / 2))
    table = Table(title=f"{title}: {n} units", title_style="bold")
    for heading in ("coefficient", "claimed", f"rms / claimed\n{low:.2f} … {high:.2f}", f"mean·√n\n± {largest:.2f}"):
        table.add_column(heading, justify="right")
    table.add_column("preview / claimed", justify="right")
    found: list[str] = []
    for i, name in enumerate(NAMES):
        unit, size = ("deg/h", units.DEG_PER_HOUR) if name.startswith("b") else ("ppm", units.PPM)
        rms, mean = float(np.sqrt(np.mean(z[:, i] ** 2))), float(z[:, i].mean() * np.sqrt(n))
        claim, ratio = float(claimed[:, i].mean()) / size, float(np.mean(previewed[:, i] / claimed[:, i]))
        table.add_row(name, f"{claim:.3g} {unit}", f"{rms:.3f}", f"{mean:+.2f}", f"{ratio:.3f}")
        if not low <= rms <= high or abs(mean) > largest:
            found.append(f"{title}: {name}: rms / claimed {rms:.3f}, mean·√n {mean:+.2f}")
    console.print(table)
    degrees = sum(o.degrees for o in outcomes)
    chi, limits = (
        float(np.mean([o.chi_square for o in outcomes])),
        [f(LEVEL / 2, degrees) for f in (chi2.ppf, chi2.isf)],
    )
    p = float(kstest([o.p_value for o in outcomes], "uniform").pvalue)
    console.print(
        f"mean χ²/dof {chi:.4f} (allowed {limits[0] / degrees:.3f} … {limits[1] / degrees:.3f}); KS p {p:.3g}"
    )
    if not limits[0] <= chi * degrees <= limits[1] or p < LEVEL:
        found.append(f"{title}: χ²/dof {chi:.4f}, KS p {p:.3g}")
    own = [NAMES.index(f"K{i}{i}") for i in (1, 2, 3)]
    console.print(f"largest 3σ of a scale factor {3e6 * claimed[:, own].max():.2f} ppm\n")
    return found


def main() -> int:
    """Both kinds of unit."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--units", type=int, default=200)
    parser.add_argument("--stepped", type=int, default=2)
    wanted = parser.parse_args()
    console, found = Console(width=110), []
    for title, first, accuracy in (
        ("axes 3″, pointing 1″, level 1″", 6_000_000, TableAccuracy(3.0, 1.0, 1.0)),
        ("ideal table", 7_000_000, TableAccuracy()),
    ):
        made = track(population(first, wanted.units, accuracy), title, wanted.units, console=console)
        found += show(title, list(made), console)
    for seed in range(8_000_000, 8_000_000 + wanted.stepped):
        accuracy = TableAccuracy(3.0, 1.0, 1.0)
        one = judged(WorldConfig(uneven(random_unit_truth(seed)), bench(seed, accuracy), seed), stepped=True)
        z = one.errors / one.claimed
        far = [f"{name} {v:+.1f}σ" for name, v in zip(NAMES, z, strict=True) if abs(v) > norm.isf(LEVEL / 2)]
        console.print(f"stepped unit {seed}: largest error {np.abs(z).max():.2f} σ, p = {one.p_value:.3g}")
        found += [f"stepped unit {seed}: {f}" for f in far]
        found += [f"stepped unit {seed}: p = {one.p_value:.3g}"] if one.p_value < LEVEL else []
    console.print("\n".join(found) if found else "[green]all within the tolerance of the sample[/green]")
    return 1 if found else 0


if __name__ == "__main__":
    sys.exit(main())
