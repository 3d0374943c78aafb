"""The one table from errors to status codes."""

from bench_service.model.errors import (
    AlreadyReserved,
    BenchBusy,
    CalibrationRefused,
    CorrectionRefused,
    DamagedDatabase,
    DamagedRecording,
    IdempotencyConflict,
    IllegalTransition,
    LockedOut,
    ManualRefused,
    MountingChanged,
    NameTaken,
    NotAllowed,
    NotDriving,
    NotFound,
    NotMounted,
    NotReady,
    NotSafe,
    NotUnderstood,
    Overloaded,
    RawDataRemoved,
    ServiceError,
    SeveralStops,
    StorageFailure,
    StorageFull,
    WrongPassword,
)
from procedures.bench.errors import BenchError
from procedures.core.errors import DomainError

STATUS: dict[type[Exception], int] = {
    NotFound: 404,
    IllegalTransition: 409,
    IdempotencyConflict: 409,
    BenchBusy: 409,
    ManualRefused: 409,
    AlreadyReserved: 409,
    NameTaken: 409,
    CalibrationRefused: 409,
    CorrectionRefused: 409,
    NotAllowed: 403,
    WrongPassword: 401,
    LockedOut: 429,
    NotDriving: 503,
    NotReady: 503,
    Overloaded: 503,
    NotMounted: 422,
    MountingChanged: 409,
    NotSafe: 409,
    SeveralStops: 409,
    NotUnderstood: 409,
    DomainError: 422,
    BenchError: 502,
    RawDataRemoved: 410,
    StorageFull: 507,
    DamagedRecording: 409,
    DamagedDatabase: 500,
    StorageFailure: 503,
    ServiceError: 500,
}
"""Status codes by error class; an error has the status of its nearest ancestor here."""


def status_of(error: Exception) -> int:
    """Return the status code of a known error."""
    return next(STATUS[cls] for cls in type(error).__mro__ if cls in STATUS)
