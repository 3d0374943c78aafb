"""The linear estimator of a triad's coefficients, its weights, and the propagation of the table's flaws.

Two weightings. "noise": the table is taken as it is commanded, and each channel is weighted by its noise alone (thesis
3.3.6). "noise_and_table": the table's flaws are unknowns with declared spreads, so the outputs are weighted by
``S = C + F·Fᵀ``, with C the noise of the station means and F = K·∂v/∂p·σ_p the flaws at one standard deviation each.
"""

from dataclasses import dataclass
from typing import Literal

import numpy as np

from procedures.analysis.calibration.table_errors import SOURCES, TableErrors
from procedures.analysis.least_squares.determination import require_full_rank
from procedures.analysis.least_squares.inverse import scaled_pinv
from procedures.analysis.least_squares.whitening import whiteners
from procedures.core.arrays import Array

Weighting = Literal["noise_and_table", "noise"]
MOUNTING = "mounting"
"""Source of uncertainty that no station of one mounting shows: the repeatability of the seat."""


@dataclass(frozen=True)
class Estimator:
    """The linear estimator of a plan: its gain on the outputs and the propagated noise covariance."""

    design: Array
    """Design matrix A of one channel, rows [1 v_x v_y v_z], shape (n, 4)."""
    gain: Array
    """Gain G: the twelve coefficients are ``Σ G[:, c, i]·U[i, c]`` over channels and stations, shape (12, 3, n)."""
    noise_covariance: Array
    """Noise covariance ``G·C·Gᵀ`` of the twelve coefficients, channel by channel, shape (12, 12)."""
    condition: float
    """Condition number of the column-scaled design."""

    def coefficients(self, outputs: Array) -> Array:
        """Return the twelve coefficients estimated from outputs (n, 3); shape (12,)."""
        return np.einsum("kcn,nc->k", self.gain, outputs)

    def modelled(self, coefficients: Array) -> Array:
        """Return the outputs ``b + K·v`` at the stations, predicted from twelve coefficients, shape (n, 3)."""
        return self.design @ coefficients.reshape(3, 4).T

    def remaining(self) -> Array:
        """Return the operator ``1 − A·G``: residuals from outputs, both stacked channel by channel, shape (3n, 3n)."""
        n = len(self.design)
        explained = np.einsum("ia,cadj->cidj", self.design, self.gain.reshape(3, 4, 3, n))
        return np.eye(3 * n) - explained.reshape(3 * n, 3 * n)


@dataclass(frozen=True)
class TableShare:
    """Contribution of the table's flaws to the uncertainty of the twelve coefficients, by source."""

    per_sd: Array
    """Change of the coefficients per standard deviation of each flaw, shape (12, P)."""
    source: tuple[str, ...]

    @property
    def covariance(self) -> Array:
        """Covariance of the twelve coefficients from all flaws, shape (12, 12)."""
        return self.per_sd @ self.per_sd.T

    def standard_uncertainty(self, source: str) -> Array:
        """Return the standard uncertainties of the twelve coefficients from one source alone, shape (12,)."""
        columns = np.array([s == source for s in self.source], dtype=bool)
        return np.sqrt(np.sum(self.per_sd[:, columns] ** 2, axis=1))

    def by_source(self) -> dict[str, Array]:
        """Return the standard uncertainties (12,) of every source that contributes, by its name."""
        parts = {source: self.standard_uncertainty(source) for source in (*SOURCES, MOUNTING)}
        return {source: part for source, part in parts.items() if np.any(part > 0.0)}


def estimator(what: str, vectors: Array, noise_covariance: Array, of_table: Array | None = None) -> Estimator:
    """Generalised least squares for input vectors (n, 3) and covariances of the station means (3, n, n).

    ``x̂ = (AᵀS⁻¹A)⁻¹AᵀS⁻¹·U`` over all three channels. `of_table` F has shape (n, 3, P), as `TableErrors.of_outputs`
    gives it; without it, or where no flaw is declared, S = C and each channel stands alone. Raises `Undetermined`
    naming the lost combinations.
    """
    design = np.column_stack([np.ones(len(vectors)), vectors])
    condition = require_full_rank(what, design, ("b_i", "K_i1", "K_i2", "K_i3"))
    weights = whiteners(noise_covariance)
    flaws = None if of_table is None else of_table[:, :, np.any(of_table != 0.0, axis=(0, 1))]
    if flaws is None or flaws.shape[2] == 0:
        gain, covariance = _by_channel(design, weights)
    else:
        gain = _with_flaws(design, weights, flaws)
        rows = gain.reshape(12, -1)
        covariance = _times_each(gain, noise_covariance).reshape(12, -1) @ rows.T
    return Estimator(design, gain, covariance, condition)


def _by_channel(design: Array, whitening: Array) -> tuple[Array, Array]:
    """Gain (12, 3, n) and covariance (12, 12) of three separate fits, whitening (3, n, n)."""
    gain, covariance = np.zeros((3, 4, 3, len(design))), np.zeros((3, 4, 3, 4))
    for channel, weights in enumerate(whitening):
        pseudo_inverse = scaled_pinv(weights @ design)
        gain[channel, :, channel] = pseudo_inverse @ weights
        covariance[channel, :, channel] = pseudo_inverse @ pseudo_inverse.T
    return gain.reshape(12, 3, -1), covariance.reshape(12, 12)


def _with_flaws(design: Array, whitening: Array, flaws: Array) -> Array:
    """Gain (12, 3, n) where flaws (n, 3, P) at one standard deviation each are estimated together with the triad.

    With ``W·C·Wᵀ = 1`` the least squares of ``|W(U − A·x − F·p)|² + |p|²`` over x and p has the x of S = C + F·Fᵀ
    (matrix inversion lemma), and S is never inverted: dwells whose noise is negligible against the table's flaws stay
    well conditioned. In the orthogonal factors of [W·F W·A; 1 0], flaws first, R of the coefficients is the last block.
    """
    n, p = len(design), flaws.shape[2]
    scale = np.linalg.norm(design, axis=0)
    stacked = np.zeros((3 * n + p, p + 12))
    for channel, weights in enumerate(whitening):
        rows = slice(channel * n, channel * n + n)
        stacked[rows, :p] = weights @ flaws[:, channel]
        stacked[rows, p + 4 * channel : p + 4 * channel + 4] = weights @ design / scale
    stacked[3 * n :, :p] = np.eye(p)
    q, r = np.linalg.qr(stacked)
    # the LU of a triangle is the triangle, so the digits are those of a triangular solver; that of scipy wakes threads
    # of BLAS and waits for them, 10 ms a call on a busy machine
    whitened = np.linalg.solve(r[p:, p:], q[: 3 * n, p:].T).reshape(12, 3, n)
    return _times_each(whitened, whitening) / np.tile(scale, 3)[:, None, None]


def _times_each(gain: Array, matrices: Array) -> Array:
    """The rows of each channel times that channel's matrix, (12, 3, n) by (3, n, n), shape (12, 3, n)."""
    return np.matmul(gain.transpose(1, 0, 2), matrices).transpose(1, 0, 2)


def table_share(plan: Estimator, of_table: Array, table: TableErrors, matrix: Array) -> TableShare:
    """The table's flaws carried through the outputs `of_table` F (n, 3, P) and the estimator into the coefficients.

    With the repeatability of the seat: a unit of `matrix` K (3, 3) that sits turned by a small δ has ``K·(1 − [δ]×)``.
    """
    flaws = of_table.transpose(1, 0, 2).reshape(3 * of_table.shape[0], of_table.shape[2])
    per_sd, source = plan.gain.reshape(12, -1) @ flaws, table.source
    if table.seat_sd_rad > 0.0:
        turned = -np.cross(np.eye(3)[:, None, :], np.eye(3)[None, :, :]).transpose(0, 2, 1)
        seat = np.zeros((3, 4, 3))
        seat[:, 1:] = np.einsum("ij,ajk->ika", matrix, turned) * table.seat_sd_rad
        per_sd, source = np.hstack([per_sd, seat.reshape(12, 3)]), (*source, *(MOUNTING,) * 3)
    return TableShare(per_sd, source)
