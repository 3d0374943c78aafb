"""Detection of a lost database: devices that were driven before should have jobs in it."""

from bench_service.bench.devices import DeviceState
from bench_service.jobs.stores import JobStore


def is_empty(jobs: JobStore) -> bool:
    """Return whether the database has no job. Raises `StorageFailure`."""
    return not jobs.has_any()


def missing_history(devices: DeviceState | None, jobs: JobStore) -> str:
    """Return a sentence where the devices were driven on this host before and the database has no job; else "".
    `devices` None: never driven here.

    The first start of a bench takes the devices' link once; every job takes it once more.
    """
    if devices is None or devices.openings <= 1 or not is_empty(jobs):
        return ""
    last = "" if devices.at is None else f", last at {devices.at.isoformat(timespec='seconds')} by {devices.by}"
    return (
        f"its devices were driven on this host before ({devices.openings} times{last}), and the database has no job. "
        "If it is not a new one on purpose, the history is missing: BENCH_DATABASE_URL names another database, or its "
        "files were lost; end the service and take a copy back with `bench restore`"
    )
