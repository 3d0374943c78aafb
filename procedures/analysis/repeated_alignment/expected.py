"""Expected errors of repeated alignments: their full covariance, by source.

To first order the error of (heading, pitch, roll) at alignment i is ``J_i·δ(f, ω)_i``, with J_i the derivative of the
attitude at the place (`navigation.alignment`), and the vectors' errors are those of a calibrated unit in its launches.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from scipy.spatial.transform import Rotation

from procedures.analysis.calibration.reference import reference_vectors
from procedures.analysis.calibration.station_noise import triad_covariance
from procedures.analysis.calibration.station_plan import windows
from procedures.analysis.calibration.table_errors import TableUncertainty, table_errors
from procedures.analysis.navigation.alignment import InitialAttitude, initial_attitude, require_alignable
from procedures.core import units
from procedures.core.arrays import Array
from procedures.core.errors import BadParameter, Undetermined
from procedures.core.frames import reference_rotation, table_rotation
from procedures.core.imu_model import TriadCalibration
from procedures.core.recording import Station
from procedures.core.site import Site
from procedures.core.table_angles import TableAngles
from procedures.core.unit import Unit

TRIADS = ("accelerometer", "gyro")
CALIBRATION, LAUNCH, NOISE, TABLE = "calibration", "launch to launch", "noise", "table"
ANGLES = ("heading", "pitch", "roll")


@dataclass(frozen=True)
class Alignments:
    """Repeated alignments of one unit at n attitudes of a table."""

    unit: Unit
    site: Site
    table: TableUncertainty
    angles: tuple[TableAngles, ...]
    windows: Array
    """[start, stop] of each since its own launch [s], shape (n, 2)."""
    launches: tuple[int, ...]
    """Launch of each alignment, (n,)."""


@dataclass(frozen=True)
class ExpectedErrors:
    """Covariance of the errors of all angles, each (3n, 3n) [rad²], alignment by alignment (heading, pitch, roll)."""

    by_source: Mapping[str, Array]
    noise_known: bool
    """False: the noise of some triad is unknown, and its part is missing."""

    def of_angle(self, angle: int) -> Array:
        """Return the covariance from all sources together for one of `ANGLES` by index, shape (n, n)."""
        whole = np.sum(list(self.by_source.values()), axis=0)
        return np.asarray(whole[angle::3, angle::3], dtype=np.float64)

    def part(self, source: str, angle: int) -> Array:
        """Return the covariance from one source for one of `ANGLES` by index, shape (n, n)."""
        return self.by_source[source][angle::3, angle::3]


def planned_alignments(
    unit: Unit, site: Site, table: TableUncertainty, stations: Sequence[Station], axes: Sequence[tuple[float, float]]
) -> Alignments:
    """Alignments from stations that all have angles; switching off before a station begins a new launch.

    `axes` are (rate, acceleration) of the table's axes, for the time that moves take.
    """
    spans = windows(stations, axes)
    begins, launch, launches = 0.0, 0, list[int]()
    since = np.empty_like(spans)
    for i, station in enumerate(stations):
        if station.power_off_s > 0.0:
            begins = (float(spans[i - 1, 1]) if i else 0.0) + station.power_off_s
            launch += 1
        launches.append(launch)
        since[i] = spans[i] - begins
    angles = tuple(s.angles for s in stations if s.angles is not None)
    return Alignments(unit, site, table, angles, since, tuple(launches))


def reference_attitudes(angles: Sequence[TableAngles], site: Site) -> Array:
    """(heading, pitch, roll) that the table and the site's azimuth declare, shape (n, 3) [rad].

    ``rot_nb = R_y(−azimuth)·rot_rb(table) = R_y(−heading)·R_z(pitch)·R_x(roll)``: at a level table heading is the
    azimuth *minus* the outer angle, which turns by the right-hand rule about up.
    """
    declared = reference_rotation(site.azimuth_deg) * Rotation.concatenate([table_rotation(a) for a in angles])
    return declared.as_euler("YZX", suppress_warnings=True) * np.array([-1.0, 1.0, 1.0])


def calibration_in_use(unit: Unit, triad: str) -> TriadCalibration:
    """Return the unit's current calibration of a triad, used for the alignment. Raises `DomainError` without one."""
    return unit.required_calibration(triad, "align with")


def expected_errors(plan: Alignments) -> ExpectedErrors:
    """Covariance of the errors of all alignments, from four sources.

    * calibration: its coefficients' covariance P, common to all: ``δv = −K⁻¹·(δb + δK·v)``;
    * launch to launch: the calibration's launch departs from the unit's mean, common to all, and each launch does, in
      common to its alignments, by the run-to-run standard deviations; a scale factor carries its whole row of K;
    * noise: `station_noise.mean_covariance` of the dwells within a launch, independent between launches;
    * table: the declared accuracy of table and azimuth, to which the errors refer. It is taken as independent of the
      calibration's; where the same table made that, a part of both cancels and the sum is an upper figure.

    Raises `BadParameter` near a pole and for an attitude on end, `DomainError` without a calibration.
    """
    require_alignable(plan.site.latitude_deg)
    n = len(plan.angles)
    vectors = {triad: reference_vectors(triad, plan.angles, plan.site) for triad in TRIADS}
    derivatives = _derivatives(plan, vectors)
    found = {source: np.zeros((3 * n, 3 * n)) for source in (CALIBRATION, LAUNCH, NOISE, TABLE)}
    of_table, known = np.zeros((3 * n, 6 + 3 * n)), True
    for triad in TRIADS:
        calibration, v, per_vector = calibration_in_use(plan.unit, triad), vectors[triad], derivatives[triad]
        per_channel = per_vector @ np.linalg.inv(calibration.matrix_array)
        design = np.column_stack([np.ones(n), v])
        per_coefficient = np.einsum("iac,ik->iack", per_channel, design).reshape(3 * n, 12)
        found[CALIBRATION] += per_coefficient @ calibration.covariance_array @ per_coefficient.T
        flaws = table_errors(plan.angles, v, plan.table, of_gravity=triad == "accelerometer")
        of_table += (per_vector @ (flaws.sensitivity * flaws.sd)).reshape(3 * n, -1)
        in_counts = calibration.output_unit == "count"
        noise = None if in_counts else _noise(plan, triad)
        known = known and noise is not None
        if noise is not None:
            found[NOISE] += _spread(per_channel, noise)
        if not in_counts:
            found[LAUNCH] += _spread(per_channel, _launch_to_launch(plan, triad, v @ calibration.matrix_array.T))
    found[TABLE] = of_table @ of_table.T
    return ExpectedErrors(found, known)


def _derivatives(plan: Alignments, vectors: Mapping[str, Array]) -> dict[str, Array]:
    """∂(heading, pitch, roll)/∂v at each attitude, each (n, 3, 3)."""
    site = (plan.site.latitude_deg, plan.site.gravity_m_s2, plan.site.earth_rate_rad_s)
    at: dict[TableAngles, InitialAttitude] = {}
    for i, angles in enumerate(plan.angles):
        if angles in at:
            continue
        try:
            at[angles] = initial_attitude(vectors["accelerometer"][i], vectors["gyro"][i], np.zeros((6, 6)), *site)
        except Undetermined as lost:
            place = [angles.outer_deg, angles.middle_deg, angles.inner_deg]
            raise BadParameter("orientations", place, f"not on end: {lost}") from lost
    return {
        "accelerometer": np.array([at[a].per_force for a in plan.angles]),
        "gyro": np.array([at[a].per_rate for a in plan.angles]),
    }


def _noise(plan: Alignments, triad: str) -> Array | None:
    """Covariance of the mean outputs of the three channels, (3, n, n), block by block of a launch."""
    n, launches = len(plan.angles), np.array(plan.launches)
    covariance = np.zeros((3, n, n))
    blocks: dict[bytes, Array | None] = {}
    for launch in np.unique(launches):
        own = np.flatnonzero(launches == launch)
        spans = np.round(plan.windows[own], 6)  # launches that are equal except for rounding share their block
        if spans.tobytes() not in blocks:
            blocks[spans.tobytes()] = triad_covariance(plan.unit.triad(triad), spans)
        block = blocks[spans.tobytes()]
        if block is None:
            return None
        covariance[:, own[:, None], own[None, :]] = block
    return covariance


def _launch_to_launch(plan: Alignments, triad: str, outputs: Array) -> Array:
    """Covariance of the channels' run-to-run changes, (3, n, n); `outputs` K·v of shape (n, 3)."""
    record = plan.unit.triad(triad)
    n, launches = len(plan.angles), np.array(plan.launches)
    if record is None:
        return np.zeros((3, n, n))
    return record.launch_covariance(outputs) * (1.0 + (launches[:, None] == launches[None, :]))


def _spread(per_channel: Array, covariance: Array) -> Array:
    """Propagate a covariance from channels (3, n, n) to angles (3n, 3n)."""
    n = len(per_channel)
    return np.einsum("iac,cij,jbc->iajb", per_channel, covariance, per_channel).reshape(3 * n, 3 * n)


def rms_deg(covariance: Array) -> float:
    """Return the root of the mean variance of a covariance [rad²], in degrees."""
    return float(np.sqrt(np.mean(np.diagonal(covariance)))) / units.DEG
