"""Conditions under which a job that waited may still begin a station: its calibrations and its mounting stand."""

from bench_service.jobs.planning import Planner
from bench_service.model.context import withheld_calibration
from bench_service.model.errors import MountingChanged
from bench_service.model.job import Job
from procedures.core.errors import NoCalibration


def require_as_planned(job: Job, planner: Planner) -> None:
    """Refuse a station of a job whose conditions changed while it waited.

    Raises `NoCalibration` where the unit's calibration was rejected or expired, `MountingChanged` where the unit was
    mounted again, or taken off, since the job was planned.
    """
    triads = planner.catalogue.procedure(job.procedure).uses_calibration
    if refusal := withheld_calibration(job, triads):
        raise NoCalibration(refusal)
    stands = planner.mounting(job.unit, job.bench)
    if (None if stands is None else stands.id) != job.mounting:
        planned = f"mounting {job.mounting}" if job.mounting else "the bench's declared azimuth"
        found = "no mounting stands" if stands is None else f"mounting {stands.id} stands"
        raise MountingChanged(
            f"the job was planned for {planned}, and {found} of unit {job.unit} on bench {job.bench} now: submit it "
            "again"
        )
