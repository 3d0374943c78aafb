"""Errors by which an analysis or a plan refuses. They carry no status codes: the service has one table for them.

DomainError
├── BadParameter    a parameter's value is not allowed: names the field, the value and what is allowed
├── Undetermined    the plan or the recordings cannot determine a parameter: names the lost combinations
├── UnfitRecording  a recording cannot be analysed as asked: gaps, too short, constant, wrong unit
├── MissingChannel  a recording lacks a channel that is needed
├── NoCalibration   a triad has no calibration that may be used
├── UnfitResult     a result has a value that cannot be stored: names the field
└── ProcedureDefect a procedure does not do what its place in the catalogue promises: for its author
"""

from collections.abc import Sequence


class DomainError(Exception):
    """Base of all refusals; the message is fit for a person."""


class BadParameter(DomainError):
    """Raised where a parameter's value is not allowed; names the field, its value and what is allowed."""

    def __init__(self, field: str, value: object, allowed: str) -> None:
        super().__init__(f"{field} = {value!r}: {allowed}")
        self.field = field
        self.value = value
        self.allowed = allowed


class Undetermined(DomainError):
    """Raised where a set of orientations cannot determine every parameter; no numbers come out."""

    def __init__(self, what: str, lost: Sequence[str], rank: int, wanted: int, condition: float) -> None:
        super().__init__(
            f"{what} cannot be determined: rank {rank} of {wanted} (condition {condition:.3g}); lost: {'; '.join(lost)}"
        )
        self.lost = tuple(lost)
        self.rank = rank
        self.wanted = wanted
        self.condition = condition


class UnfitRecording(DomainError):
    """Raised where a recording cannot be analysed as asked; the message has the reason."""


class MissingChannel(DomainError):
    """Raised where a recording lacks a channel that is needed; names it and those that are there."""

    def __init__(self, name: str, present: Sequence[str]) -> None:
        super().__init__(f"the recording has no channel {name!r}; it has {', '.join(present) or 'none'}")
        self.name = name
        self.present = tuple(present)


class NoCalibration(DomainError):
    """Raised where a triad of the unit has no calibration, or its current one was rejected or has expired."""


class UnfitResult(DomainError):
    """Raised where a result has a value that cannot be stored, such as a number that is not finite."""

    def __init__(self, field: str, value: object, needed: str) -> None:
        super().__init__(f"{field} = {value!r}: {needed}")
        self.field = field
        self.value = value


class ProcedureDefect(DomainError):
    """Raised where a procedure does not do what its place in the catalogue promises; its author must change it."""
