"""What the machine room can refuse. No status codes here: `bench_service.api.errors` has the table.

ServiceError
├── NotFound             no such job, recording, result, unit, bench, procedure, method
├── IllegalTransition    the job's state does not allow it
├── IdempotencyConflict  the key was used before with another request
├── NameTaken            a campaign of that name is there already
├── BenchBusy            another process drives this bench
├── Misconfigured        a file that the settings name cannot be used
├── NotDriving           this process drives no bench
├── NotReady             a job could not start here now
├── NotSafe              the bench's devices are not known to be safe
├── AlreadyReserved      somebody keeps this bench or unit
├── NotMounted           this bench does not have that unit
├── StorageFull          the database cannot grow
└── StorageFailure       the database failed in another way
    └── DamagedRecording  what is stored of a recording is not what was written
"""

from collections.abc import Sequence


class ServiceError(Exception):
    """Base of all refusals of the machine room; the message is fit for a person."""


class NotFound(ServiceError):
    """There is no such thing."""

    def __init__(self, kind: str, name: str, why: str = "") -> None:
        super().__init__(f"there is no {kind} {name!r}{': ' if why else ''}{why}")
        self.kind = kind
        self.name = name


class IllegalTransition(ServiceError):
    """The job's state does not allow it."""


class IdempotencyConflict(ServiceError):
    """The key was used before with another request."""


class NameTaken(ServiceError):
    """A campaign of that name is there already."""


class BenchBusy(ServiceError):
    """Another process drives this bench; `passing`: its supervisor, which gives it back in a moment."""

    def __init__(self, message: str, passing: bool = False) -> None:
        super().__init__(message)
        self.passing = passing


class Misconfigured(ServiceError):
    """A file that the settings name cannot be used."""


class NotDriving(ServiceError):
    """This process drives no bench: it only reads."""


class NotReady(ServiceError):
    """A job could not start here now."""

    def __init__(self, reasons: Sequence[str]) -> None:
        super().__init__("; ".join(reasons))
        self.reasons = tuple(reasons)


class NotSafe(ServiceError):
    """The bench's devices are not known to be safe."""


class AlreadyReserved(ServiceError):
    """Somebody keeps this bench or unit."""


class NotMounted(ServiceError):
    """This bench does not have that unit."""


class StorageFull(ServiceError):
    """The database cannot grow: the disk is full."""


class StorageFailure(ServiceError):
    """The database failed."""


class DamagedRecording(StorageFailure):
    """What is stored of a recording is not what was written."""
