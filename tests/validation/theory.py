"""Bounds that theory allows: noise of the dwells, flaws of the table, and the bounds that follow.

Written from the truth alone, without the analysis that it judges: the covariance of the dwells from the very processes
that the simulated unit is made of, the flaws as differences of true attitudes.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from math import log, pi

import numpy as np
from scipy.linalg import block_diag

from procedures.core import units
from procedures.core.recording import Station
from procedures.core.table_angles import TableAngles
from simulators.imu.noise import CELL_S, GaussMarkovBank
from simulators.truth import Array, BenchTruth, TableTruth, TriadTruth
from simulators.turntable.device import SETTLE_S
from simulators.turntable.kinematics import at_rest, attitude
from simulators.turntable.profile import move_ticks

AXES = 3


@dataclass(frozen=True)
class Reference:
    """Reference of the two triads at the stations, gyros first, and how each flaw of the table at one sd changes it."""

    vectors: tuple[Array, Array]
    """On an ideal table, each (n, 3)."""
    flaws: tuple[Array, Array]
    """Each (n, 3, P), the same P flaws for both."""


@dataclass(frozen=True)
class Bounds:
    """Standard deviations of both triads' coefficients, each (24,)."""

    noise: Array
    """Cramér-Rao bound of the noise alone: the table known to be ideal."""
    weighted: Array
    """Of least squares with the noise's weights, which takes the table as it is declared: noise and flaws."""
    joint: Array
    """Bayesian Cramér-Rao bound: both triads at once, the flaws unknown with their declared spreads."""


def dwell_windows(bench: BenchTruth, stations: Sequence[Station], rate_hz: float) -> Array:
    """Beginning and end of each dwell [s since power-up], (n, 2): move, half a second, settle, record."""
    description = bench.description
    limits = (description.outer, description.middle, description.inner)
    now, here, ticks = 0, np.zeros(AXES), []
    for station in stations:
        there = _axes_deg([station])[0]
        now += move_ticks(there - here, limits, rate_hz) + round(SETTLE_S * rate_hz) + round(station.settle_s * rate_hz)
        ticks.append((now, now + round(station.record_s * rate_hz)))
        now, here = ticks[-1][1], there
    return np.array(ticks) / rate_hz


def dwell_covariance(truth: TriadTruth, windows: Array) -> Array:
    """Covariance of the dwells' means of the three channels, (3, n, n): readings at both ends, random walk, flicker.

    The flicker is the simulator's own finite bank, each member ``exp(−|t − u|/τ)`` averaged over two dwells. The drawn
    units have neither rate random walk nor ramp.
    """
    assert not any((*truth.rate_random_walk, *truth.rate_ramp, *truth.startup))
    lengths = windows[:, 1] - windows[:, 0]
    bank = GaussMarkovBank.over(truth.flicker_band_s, CELL_S).times_s
    member = log(truth.flicker_band_s[1] / truth.flicker_band_s[0]) / len(bank) / pi
    flicker = member * sum(_correlation(windows, tau) for tau in bank)
    noise = zip(truth.quantization, truth.random_walk, truth.bias_instability, strict=True)
    return np.array([np.diag(2.0 * (q / lengths) ** 2 + n**2 / lengths) + b**2 * flicker for q, n, b in noise])


def _correlation(windows: Array, tau: float) -> Array:
    start, stop = windows.T
    r = (stop - start) / tau
    fade = -np.expm1(-r) / r
    gap = np.maximum(start[:, None] - stop[None, :], start[None, :] - stop[:, None])
    apart = np.outer(fade, fade) * np.exp(-np.maximum(gap, 0.0) / tau)
    np.fill_diagonal(apart, 2.0 * (r + np.expm1(-r)) / r**2)
    return apart


def reference(bench: BenchTruth, stations: Sequence[Station]) -> Reference:
    """Vectors on an ideal table, and their change with each declared uncertainty of the bench."""
    accuracy, site = bench.description.accuracy, bench.description.site
    axes = _axes_deg(stations) * units.DEG
    ideal = _seen(bench, TableTruth(), axes)
    right, level, azimuth = accuracy.orthogonality_sd_arcsec, accuracy.level_sd_arcsec, site.azimuth_sd_arcsec
    constant = (
        TableTruth(outer_middle_nonorthogonality_arcsec=right),
        TableTruth(middle_inner_nonorthogonality_arcsec=right),
        TableTruth(base_tilt_north_arcsec=level),
        TableTruth(base_tilt_east_arcsec=level),
        TableTruth(azimuth_error_arcsec=azimuth),
    )
    changes = [_seen(bench, table, axes) - ideal for table in constant]
    for axis in range(AXES):
        moved = axes.copy()
        moved[:, axis] += accuracy.pointing_sd_arcsec * units.ARCSEC
        change = _seen(bench, TableTruth(), moved) - ideal
        for i in range(len(axes)):
            alone = np.zeros_like(change)
            alone[:, i] = change[:, i]
            changes.append(alone)
    flaws = np.stack(changes, axis=-1)
    return Reference((ideal[0], ideal[1]), (flaws[0], flaws[1]))


def _seen(bench: BenchTruth, table: TableTruth, axes_rad: Array) -> Array:
    """Rate and specific force, (2, n, 3)."""
    return np.array(at_rest(attitude(axes_rad, table, bench.description.site.azimuth_deg), bench.site))


def _axes_deg(stations: Sequence[Station]) -> Array:
    angles = [s.angles or TableAngles() for s in stations]
    return np.array([(a.outer_deg, a.middle_deg, a.inner_deg) for a in angles])


def bounds(seen: Reference, noise: tuple[Array, Array], matrices: tuple[Array, Array]) -> Bounds:
    """Bounds of ``U = b + K·v + n`` for covariances (3, n, n) of the dwells and the true K of both triads."""
    designs = [np.column_stack([np.ones(len(v)), v]) for v in seen.vectors for _ in range(AXES)]
    covariances = [c for of_triad in noise for c in of_triad]
    flaws = [f for k, dv in zip(matrices, seen.flaws, strict=True) for f in np.einsum("cj,njp->cnp", k, dv)]
    alone, shares = [], []
    for design, covariance, flaw in zip(designs, covariances, flaws, strict=True):
        bound, gain = _least_squares(design, covariance)
        alone.append(np.diagonal(bound))
        shares.append(gain @ flaw)
    of_noise, share = np.concatenate(alone), np.vstack(shares)
    every = np.vstack(flaws)
    together, _ = _least_squares(block_diag(*designs), block_diag(*covariances) + every @ every.T)
    table = np.sum(share**2, axis=1)
    return Bounds(np.sqrt(of_noise), np.sqrt(of_noise + table), np.sqrt(np.diagonal(together)))


def _least_squares(design: Array, covariance: Array) -> tuple[Array, Array]:
    """``(AᵀC⁻¹A)⁻¹`` and ``(AᵀC⁻¹A)⁻¹AᵀC⁻¹``, in rows and columns of like size."""
    rows, columns = np.sqrt(np.diagonal(covariance)), np.linalg.norm(design, axis=0)
    a = design / columns
    weighted = np.linalg.solve(covariance / np.outer(rows, rows), a / rows[:, None] * rows.min()).T / rows * rows.min()
    bound = np.linalg.inv(weighted @ a)
    return bound / np.outer(columns, columns) * rows.min() ** 2, bound @ weighted / columns[:, None]
