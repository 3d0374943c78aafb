"""First-order effect of the table's flaws on the vectors that the unit senses.

A small turn ε about an axis e somewhere in the chain of gimbals changes a fixed vector, seen in the unit's axes, by
``δv_b = −ε·(e_b × v_b)``, with e_b that axis in the unit's axes (from ``rot_rb = P·R(ε)·S``, ``e_b = Sᵀ·e``).
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from procedures.core import units
from procedures.core.arrays import Array
from procedures.core.frames import table_rotation
from procedures.core.table_angles import TableAngles

SOURCES = ("orthogonality", "level", "azimuth", "gravity", "pointing", "direction", "latitude")
X, Y, Z = np.eye(3)


@dataclass(frozen=True)
class TableUncertainty:
    """Standard uncertainties of the reference that a table and a site provide; all zero is an ideal bench."""

    orthogonality_sd_arcsec: float = 0.0
    """Non-orthogonality of each of the two right angles, constant over a job."""
    pointing_sd_arcsec: float = 0.0
    """Pointing error of each axis, independent at each station."""
    level_sd_arcsec: float = 0.0
    """Tilt of the outer axis about each horizontal direction, constant."""
    azimuth_sd_arcsec: float = 0.0
    """Heading of the table's zero, constant."""
    gravity_relative_sd: float = 0.0
    """Relative uncertainty of the reference magnitude; concerns the accelerometers alone."""
    mounting_sd_arcsec: float = 0.0
    """Repeatability of the unit's seat about each of its axes: no station of one mounting shows it."""
    latitude_sd_arcsec: float = 0.0
    """Latitude of the site, constant; concerns the gyros alone."""


@dataclass(frozen=True)
class TableErrors:
    """Flaws p of the table, one column each: `sensitivity` ∂v_b/∂p (n, 3, P), their standard deviations, sources."""

    sensitivity: Array
    sd: Array
    source: tuple[str, ...]
    seat_sd_rad: float = 0.0
    """Repeatability of the unit's seat about each of its axes: common to all stations, so it is in no column."""

    def of_outputs(self, matrix: Array) -> Array:
        """Return the change of the outputs per standard deviation of each flaw, ``K·∂v/∂p·σ_p``, shape (n, 3, P)."""
        return np.einsum("cj,njp->ncp", matrix, self.sensitivity * self.sd)

    def columns(self, source: str) -> NDArray[np.bool_]:
        """Return the mask of the columns that belong to a source, boolean of shape (P,)."""
        return np.array([s == source for s in self.source], dtype=bool)


def table_errors(
    angles: Sequence[TableAngles], vectors: Array, uncertainty: TableUncertainty, of_gravity: bool
) -> TableErrors:
    """The flaws of a table at n stations for input vectors (n, 3) in the unit's axes.

    Columns: orthogonality outer-middle (about x between the two) and middle-inner (about y), level about x and z of the
    reference frame, azimuth about y, the magnitude of gravity, then pointing outer, middle, inner of station after
    station, and the latitude last where its uncertainty is declared. The order does not depend on the triad, so columns
    of two triads at the same stations mean the same flaw. `of_gravity`: the vectors are specific forces, whose
    magnitude is uncertain too.
    """
    n = len(angles)
    sensitivity = np.zeros((n, 3, 6 + 3 * n))
    for i, (station, v) in enumerate(zip(angles, vectors, strict=True)):
        axes = _axes_in_unit(station)
        sensitivity[i, :, :5] = np.cross(v, axes[:5]).T
        sensitivity[i, :, 5] = v if of_gravity else 0.0
        sensitivity[i, :, 6 + 3 * i : 9 + 3 * i] = np.cross(v, axes[5:]).T
    u = uncertainty
    angular = [u.orthogonality_sd_arcsec] * 2 + [u.level_sd_arcsec] * 2 + [u.azimuth_sd_arcsec]
    sd = np.array([*np.array(angular) * units.ARCSEC, u.gravity_relative_sd])
    pointing = np.full(3 * n, u.pointing_sd_arcsec * units.ARCSEC)
    source = ("orthogonality",) * 2 + ("level",) * 2 + ("azimuth", "gravity") + ("pointing",) * (3 * n)
    seat_sd_rad = u.mounting_sd_arcsec * units.ARCSEC
    sd = np.concatenate([sd, pointing])
    if u.latitude_sd_arcsec <= 0.0:
        return TableErrors(sensitivity, sd, source, seat_sd_rad)
    by_latitude = np.zeros((n, 3)) if of_gravity else per_latitude(angles, vectors)
    sensitivity = np.concatenate([sensitivity, by_latitude[:, :, None]], axis=2)
    sd = np.append(sd, 0.0 if of_gravity else u.latitude_sd_arcsec * units.ARCSEC)
    return TableErrors(sensitivity, sd, (*source, "latitude"), seat_sd_rad)


def per_latitude(angles: Sequence[TableAngles], rates: Array) -> Array:
    """Change of the Earth's rate (n, 3) in the unit's axes per radian of latitude, (n, 3).

    ``Ω = Ω·(cos φ·N + sin φ·U)`` gives ``∂Ω/∂φ = Ω·(−sin φ·N + cos φ·U) = E × Ω``, E the east, ``Ω × U = Ω·cos φ·E``: a
    turn in the meridian's plane, which gyros at rest cannot tell from a level about the east. Zero at a pole, where
    there is no east and no azimuth.
    """
    up = np.array([table_rotation(station).inv().apply(Y) for station in angles])
    east = np.cross(rates, up)
    length = np.linalg.norm(east, axis=1)[:, None]
    defined = length > 1e-9 * np.linalg.norm(rates, axis=1)[:, None]
    return np.where(defined, np.cross(east / np.where(defined, length, 1.0), rates), 0.0)


def direction_errors(vectors: Array, sd_rad: float, magnitude_relative_sd: float) -> TableErrors:
    """Flaws of input vectors (n, 3) that were given and not set by a table: a small turn of each about any axis.

    Columns: the common magnitude, then three turns of vector after vector, independent and of `sd_rad` each.
    """
    n = len(vectors)
    sensitivity = np.zeros((n, 3, 1 + 3 * n))
    sensitivity[:, :, 0] = vectors
    for i, v in enumerate(vectors):
        sensitivity[i, :, 1 + 3 * i : 4 + 3 * i] = np.cross(v, np.eye(3)).T
    sd = np.concatenate([[magnitude_relative_sd], np.full(3 * n, sd_rad)])
    return TableErrors(sensitivity, sd, ("gravity",) + ("direction",) * (3 * n))


def _axes_in_unit(station: TableAngles) -> Array:
    """Axes of the eight turns in the unit's axes, (8, 3): two orthogonalities, two levels, azimuth, three pointings."""
    whole = table_rotation(station).inv()
    inner = Rotation.from_euler("x", station.inner_deg, degrees=True).inv()
    beyond_outer = inner * Rotation.from_euler("z", station.middle_deg, degrees=True).inv()
    return np.array(
        [
            beyond_outer.apply(X),
            inner.apply(Y),
            whole.apply(X),
            whole.apply(Z),
            whole.apply(Y),
            whole.apply(Y),
            inner.apply(Z),
            X,
        ]
    )
