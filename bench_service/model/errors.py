"""Refusals of the service layer. No status codes here: `bench_service.api.http.status` has the table.

ServiceError
├── NotFound             no such job, recording, result, unit, bench, procedure, method
├── IllegalTransition    the job's state does not allow it
├── IdempotencyConflict  the key was used before with another request
├── NameTaken            a campaign of that name exists already
├── CalibrationRefused   a calibration may not become the one that counts
├── CorrectionRefused    a correction may not become the one that counts
├── BenchBusy            another process drives this bench
├── Misconfigured        a file that the settings name cannot be used
├── NotDriving           this process drives no bench
├── NotReady             a job could not start here now
├── NotSafe              the bench's devices are not known to be safe
├── SeveralStops         a release must name one of the stops that stand
├── TooManyStops         so many stops of a bench stand that one more is not kept apart
├── NotAllowed           the role or the team does not have this right
├── WrongPassword        name or password is wrong
├── LockedOut            too many failed log-ins
├── ManualRefused        manual mode cannot begin now, or its lease has ended
├── AlreadyReserved      another holder has reserved this bench or unit
├── Overloaded           too much is requested at one time
├── NotUnderstood        a job was stored by a version whose format this one does not know
├── NotMounted           this bench does not have that unit
├── MountingChanged      the unit was mounted again, or taken off, since the job was planned
├── RawDataRemoved       the raw data of a recording were removed by a rule
├── StorageFull          the database cannot grow
└── StorageFailure       the database failed in another way
    ├── DamagedDatabase   the database's file is damaged
    ├── DatabaseMoved     the database's file was deleted or replaced while it was open
    ├── ArchiveAway       the archive of raw data cannot be reached or written
    ├── DamagedRecording  the stored bytes of a recording are not those written
    └── UnfitValue        a value cannot be stored, now or later
"""

from collections.abc import Sequence

from pydantic import ValidationError


class ServiceError(Exception):
    """Base of all refusals of the service layer; the message is fit for a person."""


class NotFound(ServiceError):
    """Raised where no object of that kind has that name."""

    def __init__(self, kind: str, name: str, why: str = "") -> None:
        super().__init__(f"there is no {kind} {name!r}{': ' if why else ''}{why}")
        self.kind = kind
        self.name = name


class IllegalTransition(ServiceError):
    """Raised where the state of a job, run, batch, stop, hold or account does not allow a request."""


class IdempotencyConflict(ServiceError):
    """Raised where the key was used before with another request."""


class NameTaken(ServiceError):
    """Raised where a campaign, account or token of that name exists already."""


class CalibrationRefused(ServiceError):
    """Raised where a calibration may not become its triad's current one; the message has the way out."""


class CorrectionRefused(ServiceError):
    """Raised where a correction may not become its kind's current one; the message has the way out."""


class BenchBusy(ServiceError):
    """Raised where another process drives this bench; `passing`: its supervisor, which gives it back in a moment."""

    def __init__(self, message: str, passing: bool = False) -> None:
        super().__init__(message)
        self.passing = passing


class Overloaded(ServiceError):
    """Raised where too much is requested at one time; the same request may be sent again later."""


class Misconfigured(ServiceError):
    """Raised where a file that the settings name cannot be used."""


class NotDriving(ServiceError):
    """Raised where this process drives no bench: it only reads."""


class NotReady(ServiceError):
    """Raised where a job could not start on this bench now."""

    def __init__(self, reasons: Sequence[str]) -> None:
        super().__init__("; ".join(reasons))
        self.reasons = tuple(reasons)


class NotSafe(ServiceError):
    """Raised where the bench's devices are not known to be safe."""


class SeveralStops(ServiceError):
    """Raised where several stops stand and a release must name one."""

    def __init__(self, bench: str, stops: Sequence[tuple[str, str]]) -> None:
        """Set up with `stops`: id and description of each."""
        super().__init__(
            f"{len(stops)} stops of bench {bench!r} stand: release each by its id, POST "
            f"/api/v1/benches/{bench}/stops/{{stop_id}}/release"
        )
        self.stops = tuple(stops)


class TooManyStops(ServiceError):
    """Raised where so many stops of a bench stand already that one more is not stored on its own."""


class NotAllowed(ServiceError):
    """Raised where the role or the team of a person or program does not have a right."""


class WrongPassword(ServiceError):
    """Raised where the name or the password of a log-in is wrong; it does not say which."""

    def __init__(self) -> None:
        super().__init__("name or password is wrong")


class LockedOut(ServiceError):
    """Raised where a name or an address has had too many failed log-ins; `wait_s`: until the next attempt [s]."""

    def __init__(self, message: str, wait_s: float) -> None:
        super().__init__(message)
        self.wait_s = wait_s


class ManualRefused(ServiceError):
    """Raised where manual mode cannot begin on a bench now, or where its lease has ended."""


class AlreadyReserved(ServiceError):
    """Raised where another holder has reserved this bench or unit."""


class NotMounted(ServiceError):
    """Raised where this bench does not have that unit."""


class MountingChanged(ServiceError):
    """Raised where a job was planned for another mounting of its unit than the one that stands."""


class NotUnderstood(ServiceError):
    """Raised for a job stored by another version of the service, in a format that this one does not know."""

    def __init__(self, job_id: str, version: str, why: Exception) -> None:
        """Set up with `why`: its reader's error; of a document with many faults only the first is shown."""
        fault = str(why)
        if isinstance(why, ValidationError):
            first = why.errors(include_url=False, include_input=False)[0]
            fault = f"{'.'.join(map(str, first['loc']))}: {first['msg']}"
        super().__init__(
            f"job {job_id} was stored by version {version} of the service, and this version does not understand it: "
            f"{fault}"
        )


class RawDataRemoved(ServiceError):
    """Raised where raw data are wanted that a retention rule removed; the message says where their hash is."""


class StorageFull(ServiceError):
    """Raised where the database cannot grow: the disk is full."""


class StorageFailure(ServiceError):
    """Raised where the database failed in any other way."""


class DamagedDatabase(StorageFailure):
    """Raised where the database's own file is damaged: a part of it cannot be read, now or later."""


class DatabaseMoved(StorageFailure):
    """Raised where the file of the database is no longer the one that was opened."""


class ArchiveAway(StorageFailure):
    """Raised where the archive of raw data cannot be reached, read or written."""


class DamagedRecording(StorageFailure):
    """Raised where the stored bytes of a recording are not those written."""


class UnfitValue(StorageFailure):
    """Raised for a value that the database cannot store, or not give back: a retry changes nothing."""
