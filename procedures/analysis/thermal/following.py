"""Delay of the converter's sensor behind the case's, found from a cycle's own readings (thesis figs 3.15 and 3.16).

The board hangs on the case: ``Δ·dT_b/dt = T_c + h − T_b``, h what the board heats itself by. Sensors of time constants
τ_c and τ_b stand on both, so that readings go by ``r_b = (1 + τ_c·s)/((1 + Δ·s)(1 + τ_b·s))·r_c + h``. Readings tell
Δ, h of each run, and τ_b beside a τ_c that is given: a steady ramp shows Δ + τ_b − τ_c alone, its beginning and end
part the two. Where the readings do not go by this law, the fit says so, and nothing is to be built on it.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.optimize import least_squares
from scipy.special import chdtrc

from procedures.analysis.thermal.correlated import fit_linear
from procedures.core.arrays import Array
from procedures.core.errors import BadParameter, UnfitRecording
from procedures.importing import IMPORTING

CELL_S = 30.0
"""Cells in which the fit is judged: short against the board's delay, long against a reading's noise."""
FIRST_DELAYS_S = (60.0, 200.0, 600.0, 1800.0)
"""Starts of the search."""
STEPS = (1.0, 0.05)
"""Differences by Δ and by τ_b [s] for the Jacobian."""


@dataclass(frozen=True)
class Following:
    """Law by which the converter's sensor follows the case's: delay, lag, heating, with uncertainties."""

    delay_s: float
    """Board's own delay Δ."""
    delay_sd_s: float
    total_delay_s: float
    """Delay of reading behind reading on a steady ramp, ``Δ + τ_b − τ_c``: the Δt of thesis fig. 3.15."""
    total_delay_sd_s: float
    sensor_lag_s: float
    """Time constant τ_b of the converter's sensor, beside the case sensor's as it was given."""
    sensor_lag_sd_s: float
    """Its standard uncertainty, with that of the case sensor's time constant."""
    heating_c: tuple[float, ...]
    """Warmth h of the board over the case in each run [°C]."""
    residual_sd_c: float
    """Spread of the cells about the law."""
    p_value: float
    """Chance of as much drift about the law as the slow residuals show, were they the readings' own noise."""


def _exact(x: Array, tau: float, sample_s: float, start: float) -> Array:
    """First-order lag of a series that goes in straight lines between samples, beginning at `start`."""
    with IMPORTING:
        from scipy.signal import lfilter  # with all of scipy's statistics: only where it is called

    if tau <= 0.0:
        return x
    decay = float(np.exp(-sample_s / tau))
    share = tau / sample_s * (1.0 - decay)
    driven = (1.0 - share) * x + (share - decay) * np.concatenate([x[:1], x[:-1]])
    first = decay * start
    found, _ = lfilter([1.0], [1.0, -decay], driven, zi=[first])
    return np.asarray(found, dtype=np.float64)


def modelled(case_c: Array, sample_s: float, delay_s: float, case_lag_s: float, sensor_lag_s: float) -> Array:
    """Return the readings of the converter's sensor, (n,), by readings of the case's (n,), without heating and first
    state.
    """
    board = _exact(case_c, delay_s, sample_s, float(case_c[0]))
    board = board + case_lag_s * (case_c - board) / delay_s
    return _exact(board, sensor_lag_s, sample_s, float(board[0]))


def _cells(values: Array, size: int) -> Array:
    count = len(values) // size
    return np.asarray(values[: count * size].reshape(count, size).mean(axis=1), dtype=np.float64)


class _Runs:
    """Readings of several runs, and the model's departures from them in cells."""

    def __init__(self, case_c: Sequence[Array], converter_c: Sequence[Array], sample_s: float, case_lag_s: float):
        self.case, self.sample_s, self.case_lag_s = case_c, sample_s, case_lag_s
        self.size = max(1, round(CELL_S / sample_s))
        self.cell_s = self.size * sample_s
        self.board = [_cells(c, self.size) for c in converter_c]

    def predicted(self, delay_s: float, lag_s: float) -> list[Array]:
        return [_cells(modelled(c, self.sample_s, delay_s, self.case_lag_s, lag_s), self.size) for c in self.case]

    def free(self, run: int, delay_s: float) -> Array:
        """Columns of heating and first state of a run, (n, 2)."""
        at = (np.arange(len(self.board[run])) + 0.5) * self.cell_s
        columns = np.empty((len(at), 2))
        columns[:, 0], columns[:, 1] = 1.0, np.exp(-at / delay_s)
        return columns

    def left(self, logs: Array) -> Array:
        """Departures of all runs, heating and first state fitted, for logarithms of Δ and τ_b."""
        delay, lag = np.exp(logs).tolist()
        parts: list[Array] = []
        for run, predicted in enumerate(self.predicted(delay, lag)):
            columns, y = self.free(run, delay), self.board[run] - predicted
            parts.append(y - columns @ np.linalg.lstsq(columns, y)[0])
        return np.concatenate(parts)


def follow(
    case_c: Sequence[Array],
    converter_c: Sequence[Array],
    sample_s: float,
    case_lag_s: float = 5.0,
    case_lag_sd_s: float = 0.0,
) -> Following:
    """Find the law from readings (n_r,) of several runs r, a sample every `sample_s`.

    `case_lag_s`: time constant of the case's sensor with its standard uncertainty. Heating and first state are found
    for each run. The covariance is that of generalised least squares with the residuals' own noise. Raises
    `BadParameter`, `UnfitRecording` where the temperatures hardly move or nothing converges.
    """
    if not 0.0 <= case_lag_s < 600.0:
        raise BadParameter("case_lag_s", case_lag_s, "within 0 … 600 s")
    if max((float(np.ptp(c)) for c in case_c), default=0.0) < 5.0:
        raise UnfitRecording("the case's temperature moved by less than 5 °C: no delay shows")
    runs = _Runs(case_c, converter_c, sample_s, case_lag_s)
    starts = [np.log([delay, max(case_lag_s, 1.0)]) for delay in FIRST_DELAYS_S]
    first = min(starts, key=lambda p: float(np.sum(runs.left(p) ** 2)))
    bounds = (np.log([1.0, 0.02]), np.log([1e5, 600.0]))
    found = least_squares(runs.left, first, bounds=bounds, x_scale=[0.1, 0.5])
    delay, lag = np.exp(found.x).tolist()
    return _claimed(runs, delay, lag, case_lag_sd_s)


def _claimed(runs: _Runs, delay: float, lag: float, case_lag_sd_s: float) -> Following:
    """One step of generalised least squares about the search's answer, with its covariance."""
    at, later, slower = (
        runs.predicted(d, t) for d, t in ((delay, lag), (delay + STEPS[0], lag), (delay, lag + STEPS[1]))
    )
    designs: list[Array] = []
    count = len(runs.board)
    for run in range(count):
        free = np.zeros((len(at[run]), 2 * count))
        free[:, 2 * run : 2 * run + 2] = runs.free(run, delay)
        moved = [(later[run] - at[run]) / STEPS[0], (slower[run] - at[run]) / STEPS[1]]
        designs.append(np.column_stack([*moved, free]))
    values = [board - a for board, a in zip(runs.board, at, strict=True)]
    fit = fit_linear(designs, values, [np.ones(len(v)) for v in values], runs.cell_s)
    delay, lag = delay + float(fit.coefficients[0]), max(lag + float(fit.coefficients[1]), 0.0)
    own = fit.covariance[:2, :2]
    total = float(np.sqrt(own.sum()))
    left = np.concatenate(fit.residuals)
    return Following(
        delay,
        float(np.sqrt(own[0, 0])),
        delay + lag - runs.case_lag_s,
        total,
        lag,
        float(np.hypot(np.sqrt(own[1, 1]), case_lag_sd_s)),
        tuple(fit.coefficients[2::2].tolist()),
        float(np.std(left)),
        _drift(fit.residuals, runs),
    )


def _drift(residuals: Sequence[Array], runs: _Runs) -> float:
    """p-value of the residuals' slow part: means of eight stretches of each run against the noise of both readings.

    The converter's shows in the cells' scatter; the case's, which the delay has smoothed away there, in its readings'
    second differences.
    """
    statistic, freedom = 0.0, 0
    for left, case in zip(residuals, runs.case, strict=True):
        parts = np.array_split(left, 8)
        noise = 0.5 * float(np.mean(np.diff(left) ** 2)) + float(np.mean(np.diff(case, 2) ** 2)) / 6.0 / runs.size
        statistic += sum(float(p.mean()) ** 2 * len(p) for p in parts) / max(noise, 1e-300)
        freedom += len(parts) - 2
    return float(chdtrc(freedom, statistic))
