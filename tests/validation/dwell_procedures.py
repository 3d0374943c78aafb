"""Stop rule of each procedure that dwells: spread of what it finds against fixed dwells, by simulation and by claim.

For `dwells`. Each unit is drawn and measured twice on the same ideal table, in the same launch: with the rule, and with
one fixed dwell for all units, as long as the rule's dwells were on average. The rule stops on σ of a station's mean by
the unit's own noise, so its dwells are long for a noisy unit and short for a quiet one; the fixed dwell is the same for
both. Of units with equal noise the two spreads are equal. Of white noise N² that differs they are, too, over all units:
with the rule ``N²/T = σ²``, and with the fixed dwell ``mean(N²)/mean(T) = σ²``. Of quantization, ``Q²/T²``, the fixed
dwell has ``mean(Q²)/mean(Q)²`` times the variance; slow noise, which no dwell averages, is the same in both. What is
left of a difference comes from the checks' interval and from the channels that are not the noisiest; the claims of both
have it, without chance.
"""

import asyncio
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import cache
from typing import Any

import numpy as np
from rich.table import Column, Table

from procedures import catalog
from procedures.core import units
from procedures.core.imu_model import COEFFICIENT_NAMES, triad_calibration
from procedures.core.recording import TRIADS, MemoryRecording
from procedures.core.unit import TriadRecord, Unit
from procedures.dwells import DwellParameters
from procedures.procedure import Context
from simulators.truth import Array, UnitTruth, declared_unit, random_unit_truth
from simulators.world import WorldConfig, build, launch_truth
from tests.kit.exported_calibrations import UNITS
from tests.kit.procedures import recorded
from tests.validation.population import SCENARIOS

RATE_HZ, LONGEST_S, TARGET_DEG_H = 20.0, 200.0, 0.02
PROCEDURES = sorted(n for n, p in catalog.discover().items() if issubclass(p.params, DwellParameters))
"""Names of all procedures that take `stop_at`."""
FIRST_SEED = 8_000_000
WITHIN = 0.1
"""Largest difference from 1 of the ratio of the two spreads that counts as none."""
RESAMPLES = 4000
EXACT = 1e-30 * np.eye(12)
"""Covariance of a calibration that is the truth."""


@dataclass(frozen=True)
class Measured:
    """One unit through one procedure: errors of each group and their claims, and the dwells."""

    errors: dict[str, Array]
    claims: dict[str, Array]
    dwells_s: Array


@dataclass(frozen=True)
class Compared:
    """One group of one procedure: spreads over all units with fixed dwells and with the rule."""

    procedure: str
    group: str
    fixed: float
    stopped: float
    low: float
    high: float
    claimed: float
    """Ratio of the two spreads that the claims of all units predict."""

    @property
    def ratio(self) -> float:
        """Spread with the rule over that of fixed dwells."""
        return self.stopped / self.fixed

    @property
    def outcome(self) -> str:
        """Whether the spreads are the same within `WITHIN`, as far as the number of units tells."""
        if self.low > 1.0 + WITHIN or self.high < 1.0 - WITHIN:
            return "no"
        return "yes" if self.low >= 1.0 - WITHIN and self.high <= 1.0 + WITHIN else "not told apart"


def unit_of(seed: int) -> UnitTruth:
    """A drawn unit at a low rate; dithers, which alias there, are off."""
    truth = random_unit_truth(seed)
    still = {t: replace(getattr(truth, t), dither_residue=(0.0, 0.0, 0.0)) for t in TRIADS}
    return replace(truth, sample_rate_hz=RATE_HZ, **still)


@cache
def world_of(seed: int) -> WorldConfig:
    """The unit on an ideal table that is declared ideal."""
    return WorldConfig(unit_of(seed), SCENARIOS[0].bench(seed), seed, RATE_HZ)


def known_unit(seed: int, name: str) -> Unit:
    """The declared unit without changes from launch to launch; for a verification with its true calibration."""
    config = world_of(seed)
    unit = declared_unit(config.unit)
    steady: dict[str, TriadRecord] = {}
    for triad in TRIADS:
        record = unit.triad(triad)
        assert record is not None
        steady[triad] = replace(record, bias_run_to_run_sd=0.0, scale_factor_run_to_run_sd=0.0)
    unit = replace(unit, **steady)
    if not name.startswith("verification"):
        return unit
    true = launch_truth(config, 1)
    rows = ((t, u, np.column_stack(true[t]).ravel()) for t, u in UNITS.items())
    return replace(unit, calibrations=tuple(triad_calibration(t, u, u, c, EXACT) for t, u, c in rows))


def measured(seed: int, name: str, given: dict[str, Any]) -> Measured:
    """Record and analyse by the procedure itself; errors against the truth of the launch."""
    procedure, config = catalog.discover()[name], world_of(seed)
    context = Context(known_unit(seed, name), config.bench.description)
    params = procedure.resolve(procedure.params.model_validate(given), context)
    recordings = asyncio.run(_recordings(procedure, procedure.schedule(params), config))
    result = procedure.analyse(recordings, params, context)
    claims = {str(u.name): u.standard_uncertainty for u in procedure.predict(params, context).uncertainties}
    of_groups = _magnitudes if name.startswith("verification") else _coefficients
    errors, claimed = of_groups(result, procedure, config, claims)
    return Measured(errors, claimed, np.array([r.info.duration_s for r in recordings]))


async def _recordings(procedure: Any, stations: Sequence[Any], config: WorldConfig) -> list[MemoryRecording]:
    bench, found = build(config), list[MemoryRecording]()
    async for stream in procedure.acquire(bench, stations):
        raw = np.concatenate([block async for block in stream.blocks])
        found.append(recorded(stream, raw, len(found), "drawn"))
    await bench.make_safe()
    return found


Groups = tuple[dict[str, Array], dict[str, Array]]


def _coefficients(result: Any, procedure: Any, config: WorldConfig, claims: dict[str, float]) -> Groups:
    """Errors and claims of b, of K's diagonal and of its cross-couplings, of each triad."""
    errors, claimed, true = dict[str, Array](), dict[str, Array](), launch_truth(config, 1)
    for made in procedure.calibrations(result):
        difference = made.coefficients - np.column_stack(true[made.triad]).ravel()
        names = [f"{made.triad}.{n}" for n in COEFFICIENT_NAMES]
        sd = np.array([claims[n] for n in names])
        for group, rows in _ROWS.items():
            errors[f"{made.triad} {group}"], claimed[f"{made.triad} {group}"] = difference[rows], sd[rows]
    return errors, claimed


_ROWS = {
    "b": [0, 4, 8],
    "K diagonal": [1, 6, 11],
    "K cross-coupling": [2, 3, 5, 7, 9, 10],
}


def _magnitudes(result: Any, _procedure: Any, _config: WorldConfig, claims: dict[str, float]) -> Groups:
    """Errors and claims of the corrected magnitudes at all stations, of each triad."""
    errors, claimed = dict[str, Array](), dict[str, Array]()
    for triad, found in zip(TRIADS, result.triads, strict=True):
        name, m = f"{triad} magnitude", found.magnitudes
        errors[name] = np.array(m.after) - m.reference
        claimed[name] = np.array([sd for n, sd in claims.items() if n.startswith(f"{triad}.magnitude")])
    return errors, claimed


def compared(name: str, count: int, each: Callable[[Sequence[int]], Any]) -> tuple[list[Compared], str]:
    """Groups of a procedure over many units, and a sentence on the time saved."""
    seeds = [FIRST_SEED + k for k in range(count)]
    ruled = {"dwell_s": LONGEST_S, "stop_at": {"gyro_deg_h": TARGET_DEG_H}}
    stopped = [measured(seed, name, ruled) for seed in each(seeds)]
    lengths = np.array([m.dwells_s for m in stopped])
    fixed_s = float(lengths.mean())
    fixed = [measured(seed, name, {"dwell_s": fixed_s}) for seed in each(seeds)]
    needed_s = float(lengths.max())
    told = (
        f"{name}: dwells {lengths.min():g} … {needed_s:g} s by the rule, {fixed_s:.1f} s on average, as long as the "
        f"fixed ones; time saved {100.0 * (1.0 - fixed_s / LONGEST_S):.0f} % of dwells of {LONGEST_S:g} s, and "
        f"{100.0 * (1.0 - fixed_s / needed_s):.0f} % of one dwell for all that serves the noisiest unit"
    )
    return [_compared(name, group, fixed, stopped) for group in stopped[0].errors], told


def _compared(name: str, group: str, fixed: Sequence[Measured], stopped: Sequence[Measured]) -> Compared:
    """Ratio of root mean squares over units, with the interval of a paired bootstrap over units."""
    squares = np.array([[np.mean(m.errors[group] ** 2) for m in side] for side in (fixed, stopped)])
    claims = np.array([[np.mean(m.claims[group] ** 2) for m in side] for side in (fixed, stopped)])
    drawn = np.random.default_rng(5).integers(squares.shape[1], size=(RESAMPLES, squares.shape[1]))
    ratios = np.sqrt(squares[1][drawn].mean(axis=1) / squares[0][drawn].mean(axis=1))
    low, high = np.quantile(ratios, (0.025, 0.975)).tolist()
    of_fixed, of_rule = np.sqrt(squares.mean(axis=1)).tolist()
    claimed = float(np.sqrt(claims[1].mean() / claims[0].mean()))
    return Compared(name, group, of_fixed, of_rule, low, high, claimed)


def table_of(rows: Sequence[Compared]) -> Table:
    """A row a group of coefficients."""
    table = Table(
        Column("procedure", no_wrap=True),
        Column("group", no_wrap=True),
        "unit",
        "spread, fixed",
        "spread, rule",
        "rule / fixed",
        "95 % interval",
        "by the claims",
        f"within {100 * WITHIN:.0f} %",
    )
    for r in rows:
        unit, size = _display(r.group)
        spreads = (f"{r.fixed / size:.3g}", f"{r.stopped / size:.3g}", f"{r.ratio:.3f}", f"{r.low:.3f} … {r.high:.3f}")
        table.add_row(r.procedure, r.group, unit, *spreads, f"{r.claimed:.3f}", r.outcome)
    return table


def _display(group: str) -> tuple[str, float]:
    if " K " in group:
        return "ppm", units.PPM
    return ("deg/h", units.DEG_PER_HOUR) if group.startswith("gyro") else ("m/s^2", 1.0)
