"""Computes the estimates of a job so far: numerics that the process which drives a bench does not load."""

from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np

from bench_service.evidence.recordings import RecordingSoFar
from bench_service.evidence.so_far.cells import KeptCells
from bench_service.evidence.so_far.documents import (
    AllanDocument,
    BiasDocument,
    CoefficientSoFar,
    DwellEstimates,
    JobEstimates,
    TriadEstimates,
)
from bench_service.evidence.stores import EvidenceStores
from bench_service.model.context import context_of
from bench_service.model.job import Job
from procedures.analysis.calibration.reference import TRIAD_NAMES, site_with
from procedures.analysis.calibration.station_means import station_means
from procedures.analysis.calibration.table_errors import TableUncertainty
from procedures.analysis.so_far.coefficients import CoefficientsSoFar, coefficients_so_far
from procedures.analysis.so_far.dwell import AllanSoFar, BiasSoFar, allan_so_far, bias_so_far
from procedures.core.arrays import Array
from procedures.core.errors import DomainError
from procedures.core.imu_model import COEFFICIENT_NAMES, coefficient_unit
from procedures.core.noise import NoiseCoefficients
from procedures.core.recording import TRIADS, Channel, Recording
from procedures.core.unit import Unit
from procedures.procedure import Context

KEPT = 8
"""Number of recordings whose cells are kept."""
MOST_STATIONS = 64
"""Number of stations of a job above which its coefficients are not computed after each station."""
_TABLE = ("orthogonality_sd_arcsec", "pointing_sd_arcsec", "level_sd_arcsec")
_SITE = ("latitude_deg", "gravity_m_s2", "azimuth_deg", "azimuth_sd_arcsec")


@dataclass
class Estimating:
    """Computes estimates of jobs under way; cells of the recordings that grow are kept from one look to the next."""

    stores: EvidenceStores
    read_job: Callable[[str], Job]
    _cells: KeptCells = field(default_factory=lambda: KeptCells(KEPT))

    def text(self, job_id: str) -> str:
        """Return the estimates of a job so far, as the JSON text of a `JobEstimates`."""
        job = self.read_job(job_id)
        context = context_of(job, self.stores.calibrations.several)
        done = [self.stores.recordings.load(stored.info.id) for stored in self.stores.recordings.of_job(job_id)]
        latest = self.stores.recordings.so_far(job_id) or (done[-1] if done else None)
        dwell = None if latest is None else self._dwell(latest, context.unit)
        triads, reasons = self._triads(job, done, context)
        return JobEstimates(
            job=job_id, stations_done=len(done), dwell=dwell, coefficients=triads, not_estimated=reasons
        ).model_dump_json()

    def _dwell(self, recording: RecordingSoFar, unit: Unit) -> DwellEstimates:
        info, kept = recording.info, self._cells.of(recording)
        allan: list[AllanDocument] = []
        bias: list[BiasDocument] = []
        reasons: dict[str, str] = {}
        for channel, means in zip(info.channels, kept.rates, strict=True):
            if channel.name not in _INERTIAL:
                continue
            noise = _noise_of(unit, channel)
            try:
                allan.append(_allan_document(channel, allan_so_far(means, kept.cell_s)))
                bias.append(_bias_document(channel, bias_so_far(means, kept.cell_s, noise)))
            except (DomainError, np.linalg.LinAlgError) as error:
                reasons[channel.name] = str(error)
        label = info.id if info.station is None else info.station.label
        index = None if info.station is None else info.station.index
        recorded_s = info.count / info.rate_hz
        return DwellEstimates(
            recording=info.id,
            station=index,
            label=label,
            recorded_s=recorded_s,
            allan=allan,
            bias=bias,
            not_estimated=reasons,
        )

    def _triads(
        self, job: Job, done: list[RecordingSoFar], context: Context
    ) -> tuple[list[TriadEstimates], dict[str, str]]:
        found: list[TriadEstimates] = []
        reasons: dict[str, str] = {}
        if len(done) < 2 or len(done) > MOST_STATIONS or any(not _at_rest(one) for one in done):
            return found, reasons
        site = site_with(context.bench.site, *(job.parameters.get(name) for name in _SITE))
        declared = {**vars(context.bench.accuracy), **job.parameters}
        table = TableUncertainty(
            **{name: float(declared.get(name) or 0.0) for name in _TABLE},
            azimuth_sd_arcsec=site.azimuth_sd_arcsec,
            gravity_relative_sd=site.gravity_sd_m_s2 / site.gravity_m_s2,
            latitude_sd_arcsec=float(job.parameters.get("latitude_sd_arcsec") or site.latitude_sd_arcsec),
        )
        for triad in TRIAD_NAMES:
            try:
                means = station_means(done, triad)
                estimates = coefficients_so_far(means, site, context.unit.triad(triad), table)
            except (DomainError, np.linalg.LinAlgError) as error:
                reasons[triad] = str(error)
                continue
            found.append(_triad_document(estimates))
        return found, reasons


_INERTIAL = frozenset(name for names in TRIADS.values() for name in names)


def _at_rest(recording: Recording) -> bool:
    station = recording.info.station
    return (
        station is not None
        and station.angles is not None
        and station.turn is None
        and station.sinusoid is None
        and station.profile is None
    )


def _noise_of(unit: Unit, channel: Channel) -> NoiseCoefficients | None:
    for triad, names in TRIADS.items():
        record = unit.triad(triad)
        if channel.name in names and record is not None and record.noise:
            return record.noise[names.index(channel.name)]
    return None


def _list(values: Array) -> list[float]:
    return [float(f"{value:.6g}") for value in values.tolist()]


def _allan_document(channel: Channel, found: AllanSoFar) -> AllanDocument:
    return AllanDocument(
        channel=channel.name,
        unit=channel.rate_unit,
        tau_s=_list(found.tau_s),
        deviation=_list(found.deviation),
        lower=_list(found.lower),
        upper=_list(found.upper),
    )


def _bias_document(channel: Channel, found: BiasSoFar) -> BiasDocument:
    return BiasDocument(
        channel=channel.name,
        unit=channel.rate_unit,
        estimate=found.estimate,
        standard_uncertainty=found.standard_uncertainty,
        at_s=_list(found.at_s),
        course=found.course.tolist(),
        course_uncertainty=_list(found.course_uncertainty),
        innovations_rms=found.innovations_rms,
        noise_known=found.noise_known,
    )


def _triad_document(found: CoefficientsSoFar) -> TriadEstimates:
    input_unit = {"gyro": "rad/s", "accelerometer": "m/s^2"}[found.triad]
    return TriadEstimates(
        triad=found.triad,
        noise_known=found.noise_known,
        coefficients=[
            CoefficientSoFar(
                name=name,
                unit=coefficient_unit(name, found.output_unit, input_unit),
                values=found.values[:, k].tolist(),
                standard_uncertainties=_list(found.standard_uncertainties[:, k]),
                determined=found.determined[-1][k],
            )
            for k, name in enumerate(COEFFICIENT_NAMES)
        ],
    )
