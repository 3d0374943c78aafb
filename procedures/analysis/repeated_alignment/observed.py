"""Observed errors of repeated alignments, and their agreement with the expected ones."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from procedures.analysis.calibration.station_means import require_unit_of, station_means
from procedures.analysis.calibration.table_errors import TableUncertainty
from procedures.analysis.calibration.verification import predicted_sd
from procedures.analysis.least_squares.chi_square import chi_square, tail_probability
from procedures.analysis.navigation.alignment import initial_attitude
from procedures.analysis.repeated_alignment.expected import (
    ANGLES,
    TRIADS,
    Alignments,
    ExpectedErrors,
    calibration_in_use,
    reference_attitudes,
    rms_deg,
)
from procedures.core import units
from procedures.core.arrays import Array
from procedures.core.errors import Undetermined, UnfitRecording
from procedures.core.imu_model import correct
from procedures.core.recording import Recording
from procedures.core.site import Site
from procedures.core.unit import Unit

Triple = tuple[float, float, float]


@dataclass(frozen=True)
class Alignment:
    """One alignment: observed (heading, pitch, roll), their errors against the table's, and the expected errors."""

    label: str
    launch: int
    """Number of its launch within the recordings, from 1."""
    duration_s: float
    attitude_deg: Triple
    error_deg: Triple
    expected_sd_deg: Triple
    """Expected standard deviations; without the noise where that is not known."""


@dataclass(frozen=True)
class AngleErrors:
    """Errors of one angle over all alignments: observed, and predicted by the unit's record and calibration."""

    angle: str
    mean_error_deg: float
    mean_error_expected_sd_deg: float
    spread_deg: float | None
    """Sample standard deviation over the alignments; None for a single one."""
    expected_spread_deg: float | None
    expected_sd_deg: float
    """Expected standard deviation of a single alignment (root mean square over all)."""
    expected_by_source_deg: Mapping[str, float]
    chi_square: float | None
    """``eᵀC⁻¹e`` over all alignments; None where the noise is not known."""
    p_value: float | None
    """Probability of a chi-square at least as large."""


def recorded_alignments(recordings: Sequence[Recording], unit: Unit, site: Site, table: TableUncertainty) -> Alignments:
    """Return times and attitudes of the recordings as alignments. Raises `UnfitRecording` where one has no table
    angles.
    """
    infos = [r.info for r in recordings]
    angles = tuple(i.station.angles for i in infos if i.station is not None and i.station.angles is not None)
    if not infos or len(angles) < len(infos):
        raise UnfitRecording("every alignment needs a recording with the table's angles")
    order = list(dict.fromkeys(i.launched_s for i in infos))
    spans = np.array([[i.since_launch_s, i.since_launch_s + i.duration_s] for i in infos])
    return Alignments(unit, site, table, angles, spans, tuple(order.index(i.launched_s) + 1 for i in infos))


def found_attitudes(recordings: Sequence[Recording], plan: Alignments) -> Array:
    """(heading, pitch, roll) of each recording's corrected means, shape (n, 3) [rad] (textbook S 3.163-3.166).

    Raises `UnfitRecording` where the recordings are not in the calibration's unit, or stood on end.
    """
    vectors: dict[str, Array] = {}
    labels: tuple[str, ...] = ()
    for triad in TRIADS:
        calibration, means = calibration_in_use(plan.unit, triad), station_means(recordings, triad)
        require_unit_of(calibration, means)
        vectors[triad], labels = correct(means.outputs, calibration), means.labels
    site = (plan.site.latitude_deg, plan.site.gravity_m_s2, plan.site.earth_rate_rad_s)
    found = np.empty((len(recordings), 3))
    for i, (force, rate) in enumerate(zip(vectors["accelerometer"], vectors["gyro"], strict=True)):
        try:
            found[i] = initial_attitude(force, rate, np.zeros((6, 6)), *site).angles_rad
        except Undetermined as lost:
            raise UnfitRecording(f"recording {labels[i]}: {lost}") from lost
    return found


def alignment_errors(found: Array, plan: Alignments) -> Array:
    """Return the found minus the declared attitudes, shape (n, 3) [rad], within ±π."""
    return np.asarray(np.angle(np.exp(1j * (found - reference_attitudes(plan.angles, plan.site)))), dtype=np.float64)


def alignments_for_display(
    recordings: Sequence[Recording], plan: Alignments, found: Array, errors: Array, expected: ExpectedErrors
) -> tuple[Alignment, ...]:
    """Return the results in display units, alignment by alignment."""
    sds = np.column_stack([np.sqrt(np.diagonal(expected.of_angle(a))) for a in range(3)])
    told: list[Alignment] = []
    for i, recording in enumerate(recordings):
        info = recording.info
        attitude = found[i] / units.DEG
        attitude[0] %= 360.0
        told.append(
            Alignment(
                info.title,
                plan.launches[i],
                info.duration_s,
                _triple(attitude),
                _triple(errors[i] / units.DEG),
                _triple(sds[i] / units.DEG),
            )
        )
    return tuple(told)


def judged_angle(angle: int, errors: Array, expected: ExpectedErrors) -> AngleErrors:
    """Return the errors (n, 3) [rad] of one of `ANGLES`, by index, judged against their covariance."""
    e, covariance = errors[:, angle], expected.of_angle(angle)
    n = len(e)
    statistic = chi_square(e, covariance) if expected.noise_known else None
    return AngleErrors(
        ANGLES[angle],
        float(e.mean()) / units.DEG,
        float(np.sqrt(covariance.sum())) / n / units.DEG,
        float(e.std(ddof=1)) / units.DEG if n > 1 else None,
        predicted_sd(covariance) / units.DEG if n > 1 else None,
        rms_deg(covariance),
        {source: rms_deg(expected.part(source, angle)) for source in expected.by_source},
        statistic,
        None if statistic is None else tail_probability(statistic, n),
    )


def _triple(values: Array) -> Triple:
    a, b, c = (float(v) for v in values)
    return a, b, c
