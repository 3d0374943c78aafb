"""Analysis of a triad's multiposition calibration, from recordings to summary: means, fit, magnitudes, cross-check."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from procedures.analysis.calibration.budget import budgets, noise_parts, observed_part, thermal_parts
from procedures.analysis.calibration.estimator import Weighting
from procedures.analysis.calibration.left_out import left_out_magnitudes
from procedures.analysis.calibration.multiposition import TriadFit, fit_triad
from procedures.analysis.calibration.reference import INPUT_UNITS, reference_magnitude, reference_vectors
from procedures.analysis.calibration.reference_temperature import (
    AtReference,
    ThermalShare,
    bring_to_reference,
    gyros_at_reference,
    thermal_share,
    thermal_warnings,
)
from procedures.analysis.calibration.scalar import fit_from_starts, nominal_start, starts_from_data
from procedures.analysis.calibration.slow_noise import slow_share
from procedures.analysis.calibration.station_means import StationMeans, station_means
from procedures.analysis.calibration.station_noise import outputs_covariance
from procedures.analysis.calibration.summary import (
    ScalarCheck,
    TriadSummary,
    scalar_check,
    triad_summary,
)
from procedures.analysis.calibration.suspect_flaw import suspect
from procedures.analysis.calibration.table_errors import TableErrors, TableUncertainty, table_errors
from procedures.analysis.calibration.verification import magnitudes
from procedures.core.arrays import Array
from procedures.core.errors import UnfitRecording
from procedures.core.recording import Recording
from procedures.core.site import Site
from procedures.core.table_angles import TableAngles
from procedures.core.temperature.gyros import GyroThermalCorrection
from procedures.core.thermal_correction import ThermalCorrection
from procedures.core.unit import TriadRecord, Unit


def analyse_triad(
    recordings: Sequence[Recording],
    triad: str,
    site: Site,
    uncertainty: TableUncertainty,
    record: TriadRecord | None,
    with_scalar: bool = False,
    weighting: Weighting = "noise_and_table",
) -> TriadSummary:
    """Return the calibration of one triad from one recording a station.

    `record`: the unit's noise; None: the scatter within the dwells stands in (`noise_of_means`). Raises
    `UnfitRecording`, `MissingChannel`, `Undetermined`. `with_scalar`: also make the cross-check from magnitudes alone.
    """
    means = station_means(recordings, triad)
    return analyse_means(means, site, uncertainty, record, with_scalar, weighting)[0]


def analyse_gyros(
    recordings: Sequence[Recording],
    site: Site,
    uncertainty: TableUncertainty,
    record: TriadRecord | None,
    weighting: Weighting = "noise_and_table",
    correction: GyroThermalCorrection | None = None,
) -> tuple[TriadSummary, TriadFit]:
    """Return the calibration of the gyros from one recording a station. Raises as `analyse_triad`.

    `correction`: takes temperature out of the station means beforehand; None: they are taken as they are. `record` as
    in `analyse_triad`.
    """
    means, more = station_means(recordings, "gyro"), dict[str, Array]()
    if correction is not None:
        means, more["thermal correction"] = gyros_at_reference(recordings, means, correction)
    return analyse_means(means, site, uncertainty, record, False, weighting, more)


def analyse_means(
    means: StationMeans,
    site: Site,
    uncertainty: TableUncertainty,
    record: TriadRecord | None,
    with_scalar: bool = False,
    weighting: Weighting = "noise_and_table",
    more: Mapping[str, Array] | None = None,
) -> tuple[TriadSummary, TriadFit]:
    """Calibrate one triad from its station means.

    `more`: covariances (3, n, n) from causes other than noise, by name. `record` and `with_scalar` as in
    `analyse_triad`. Raises `UnfitRecording`, `Undetermined`.
    """
    angles = station_angles(means)
    vectors = reference_vectors(means.triad, angles, site)
    table = table_errors(angles, vectors, uncertainty, of_gravity=means.triad == "accelerometer")
    reference = reference_magnitude(means.triad, site)
    return analyse_inputs(means, vectors, table, reference, record, with_scalar, weighting, more)


def analyse_inputs(
    means: StationMeans,
    vectors: Array,
    table: TableErrors,
    reference: float,
    record: TriadRecord | None,
    with_scalar: bool = False,
    weighting: Weighting = "noise_and_table",
    more: Mapping[str, Array] | None = None,
) -> tuple[TriadSummary, TriadFit]:
    """Calibrate one triad from its station means at known input vectors (n, 3) of one magnitude, `reference` [SI].

    `table`: the flaws of what set them; `more`, `record` and `with_scalar` as in `analyse_means`. Raises
    `UnfitRecording`, `Undetermined`.
    """
    noise, known = noise_of_means(means, record)
    noise = noise + sum((more or {}).values())
    unit = INPUT_UNITS[means.triad]
    fit = fit_triad(means.triad, means.output_unit, unit, vectors, means.outputs, noise, table, known, weighting)
    scalar = _scalar(means, reference, noise, known, fit) if with_scalar else None
    after = magnitudes(means.outputs, fit.calibration(), reference, means.labels, fit.magnitude_sd)
    others = left_out_magnitudes(fit, vectors, means.outputs, reference, means.labels)
    summary = triad_summary(fit, after, means.labels, scalar, _slow(means, noise, fit, known), others)
    parts = noise_parts(record, means.windows, means.output_unit) if known and record else [observed_part(fit)]
    parts += thermal_parts(more or {}, means.output_unit) if known else []
    return replace(summary, budgets=budgets(fit, parts, table)), fit


def _slow(means: StationMeans, noise: Array, fit: TriadFit, known: bool) -> float:
    """Share of slow noise in the variance of noise and table; zero where the noise is known."""
    if known:
        return 0.0
    own = float(np.sum(np.diagonal(noise, axis1=1, axis2=2)))
    return slow_share(means.slow_excess, noise) * own / (own + float(np.sum(fit.of_table**2)))


LEAST_SCATTER = 0.5
"""Least scatter of a dwell that counts, as a part of the median of all."""


@dataclass(frozen=True)
class AccelerometerSettings:
    """Settings of the accelerometers' calibration: scalar cross-check, weighting, thermal correction, lags of
    sensors.
    """

    with_scalar: bool = False
    weighting: Weighting = "noise_and_table"
    correction: ThermalCorrection | None = None
    """Brings their means to its reference temperatures first; None: they are taken as they are."""
    lag_s: tuple[float, float] = (0.0, 0.0)
    """Time constants of case and converter sensor [s]."""


def analyse_accelerometers(
    recordings: Sequence[Recording],
    site: Site,
    uncertainty: TableUncertainty,
    record: TriadRecord | None,
    settings: AccelerometerSettings,
) -> tuple[TriadSummary, TriadFit, ThermalShare | None, tuple[str, ...]]:
    """Calibrate the accelerometers; with a correction also return its effect on them and warnings about its use.

    `record` as in `analyse_triad`. Raises as `analyse_triad` and `bring_to_reference`.
    """
    means, correction = station_means(recordings, "accelerometer"), settings.correction
    how = settings.with_scalar, settings.weighting
    if correction is None:
        return *analyse_means(means, site, uncertainty, record, *how), None, ()
    brought = bring_to_reference(recordings, means, correction, settings.lag_s)
    summary, fit = analyse_means(brought.means, site, uncertainty, record, *how, brought.by_cause)
    return summary, fit, thermal_share(brought, fit), thermal_warnings(brought)


def brought_by_unit(
    recordings: Sequence[Recording], means: StationMeans, unit: Unit, lag_s: tuple[float, float]
) -> tuple[StationMeans, dict[str, Array], AtReference | None]:
    """Return station means at the reference temperatures of the unit's own correction, and what the correction adds to
    their uncertainty.

    The second value has the covariances (3, n, n) by cause. The third has the details of the accelerometers'
    correction; None for gyros. Without a correction of the triad the means are as they were, and there are no
    covariances. `lag_s` as in `bring_to_reference`.
    """
    if means.triad == "accelerometer" and unit.thermal_correction is not None:
        brought = bring_to_reference(recordings, means, unit.thermal_correction, lag_s)
        return brought.means, brought.by_cause, brought
    if means.triad == "gyro" and unit.gyro_correction is not None:
        own, covariance = gyros_at_reference(recordings, means, unit.gyro_correction)
        return own, {"thermal correction": covariance}, None
    return means, {}, None


def suspected(found: Sequence[tuple[TriadSummary, TriadFit]]) -> tuple[TriadSummary, ...]:
    """The summaries of triads at the same stations, each with the flaw that its residuals and the others' point to.

    A flaw of the table that one triad's residuals look like is not named where another triad's contradict it.
    """
    made: list[TriadSummary] = []
    for summary, fit in found:
        others = [other.free for _, other in found if other is not fit and other.free is not None]
        labels = [r.label for r in summary.residuals]
        made.append(summary if fit.free is None else replace(summary, suspect=suspect(fit.free, labels, others)))
    return tuple(made)


def noise_of_means(means: StationMeans, record: TriadRecord | None) -> tuple[Array, bool]:
    """Covariance of the station means, (3, n, n), and a flag that it comes from the unit's record.

    Outputs in counts have no record in their unit. Without one the scatter of batch means within each dwell stands in,
    for a dwell that hardly scatters (clipped, held) a part of the dwells' median.
    """
    known = outputs_covariance(record, means.output_unit, means.windows)
    if known is not None:
        return known, True
    floor = LEAST_SCATTER * np.median(means.mean_sd, axis=0)
    return scatter_covariance(means.outputs, np.maximum(means.mean_sd, floor)), False


def scatter_covariance(outputs: Array, sd: Array) -> Array:
    """Covariance (3, n, n) of means (n, 3) of unknown noise, from their scatter (n, 3).

    Where nothing scatters, a part in 10⁹ of the greatest output stands in, so that it can be weighed.
    """
    floor = 1e-9 * float(np.abs(outputs).max())
    return np.array([np.diag(column**2) for column in np.maximum(sd, floor if floor > 0.0 else 1.0).T])


def station_angles(means: StationMeans) -> list[TableAngles]:
    """Return the commanded table angles of every station. Raises `UnfitRecording` where one was taken without."""
    for label, angles in zip(means.labels, means.angles, strict=True):
        if angles is None:
            raise UnfitRecording(f"recording {label} has no table angles: its orientation is not known")
    return [angles for angles in means.angles if angles is not None]


def _scalar(means: StationMeans, reference: float, noise: Array, known: bool, fit: TriadFit) -> ScalarCheck:
    in_counts = means.output_unit == "count"
    starts = starts_from_data(means.outputs, reference) if in_counts else (nominal_start(),)
    scalar = fit_from_starts(f"the scalar {fit.triad} parameters", means.outputs, noise, reference, starts, known)
    return scalar_check(fit, scalar)
