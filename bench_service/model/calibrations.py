"""A calibration of one triad as it is kept in a unit's history: its value, its origin, and what people decided."""

from dataclasses import dataclass, field
from datetime import datetime
from enum import StrEnum
from typing import Protocol

from bench_service.wall_clock import new_id
from procedures.core.coefficient_name import CoefficientName
from procedures.core.imu_model import COEFFICIENT_NAMES, TriadCalibration, coefficient_unit
from procedures.core.limits import Verdict

ENTERED = "entered"
"""Method of a calibration whose coefficients a person entered."""


class Approval(StrEnum):
    """`open` until a person approves or rejects the calibration; the last decision counts."""

    OPEN = "open"
    APPROVED = "approved"
    REJECTED = "rejected"


class Act(StrEnum):
    """Kind of decision of a person about a calibration or a correction."""

    ENTERED = "entered"
    CHOSEN = "chosen"
    GIVEN_BACK = "given back"
    """A person gave the kind of a correction back to the rule, which made this one current."""
    APPROVED = "approved"
    REJECTED = "rejected"


@dataclass(frozen=True)
class Coefficient:
    """One coefficient of ``U = b + K·v``: a value of a subject, with its unit and standard uncertainty."""

    subject: str
    """Triad by its name, either "gyro" or "accelerometer"."""
    name: str
    """Symbol as in `COEFFICIENT_NAMES`: "b_x", "K11", …"""
    value: float
    unit: str
    standard_uncertainty: float

    @property
    def dotted(self) -> CoefficientName:
        """Name as results, limits and trends write it: "gyro.b_x"."""
        return CoefficientName(self.subject, self.name)


@dataclass(frozen=True)
class Decision:
    """A person's decision about a calibration; decisions are added, and never changed or removed."""

    calibration_id: str
    act: Act
    at: datetime
    by: str
    """Name of the person; empty: the rule decided."""
    proven: bool = False
    """True where the service knows the person by a log-in; False where the request declared the name."""
    remark: str = ""
    id: str = field(default_factory=new_id)


@dataclass(frozen=True)
class Decider:
    """The person who decides, and the remark that goes with the decision."""

    by: str
    remark: str = ""
    proven: bool = False


@dataclass(frozen=True)
class StoredCalibration:
    """A calibration of one triad in a unit's history. At most one of each triad is current."""

    id: str
    unit: str
    value: TriadCalibration
    """Coefficients and their covariance."""
    method: str
    """Procedure or method that gave it, or "entered"."""
    origin: str
    """Source of entered coefficients (a passport, a certificate); empty where `result_id` is the origin."""
    result_id: str | None
    """Result that gave it, whose lineage names recordings, parameters and code; None for an entered one."""
    verdict: Verdict | None
    """Verdict of that result; None for an entered one."""
    made_at: datetime
    simulated: bool
    current: bool
    by_rule: bool
    """True where the rule made it current; False where a person chose it, and while it is not current."""
    approval: Approval
    valid_from: datetime | None
    """Begin of its validity; None: it has none, as those that results give."""
    valid_until: datetime | None
    """End of its validity; None: it has none."""
    decisions: tuple[Decision, ...] = ()
    """All decisions about it, oldest first."""

    @property
    def triad(self) -> str:
        """Triad by its name, either "gyro" or "accelerometer"."""
        return self.value.triad

    @property
    def coefficients(self) -> tuple[Coefficient, ...]:
        """The twelve coefficients, in the order of `COEFFICIENT_NAMES` and of the covariance."""
        return coefficients_of(self.value)

    def unusable(self, at: datetime) -> str:
        """Return the reason why it may not be used at a time, with the way out; empty where it may."""
        what = f"calibration {self.id} of the {self.triad} triad"
        other = "choose another calibration of its history, enter known coefficients, or calibrate again"
        if self.approval is Approval.REJECTED:
            last = next((d for d in reversed(self.decisions) if d.act is Act.REJECTED), None)
            why = f" by {last.by or 'the rule'}: {last.remark}" if last else ""
            return f"{what} was rejected{why}; {other}, or approve it"
        if self.valid_until is not None and at >= self.valid_until:
            return f"{what} expired at {_shown(self.valid_until)}; {other}, or approve it with a later valid_until"
        if self.valid_from is not None and at < self.valid_from:
            return f"{what} is valid only from {_shown(self.valid_from)}; {other}"
        return ""


def coefficients_of(value: TriadCalibration) -> tuple[Coefficient, ...]:
    """Return the coefficients of a calibration with their units, in the order of `COEFFICIENT_NAMES`."""
    numbers = zip(COEFFICIENT_NAMES, value.coefficients.tolist(), value.standard_uncertainties.tolist(), strict=True)
    return tuple(
        Coefficient(value.triad, name, number, coefficient_unit(name, value.output_unit, value.input_unit), sd)
        for name, number, sd in numbers
    )


class Current(Protocol):
    """Calibration or correction that is current, as far as the rule asks about it."""

    @property
    def by_rule(self) -> bool: ...

    def unusable(self, at: datetime) -> str: ...


def takes_over(verdict: Verdict, current: Current | None, at: datetime) -> bool:
    """Return whether a job's calibration or correction becomes current: the job passed, and no usable choice of a
    person stands.

    `current`: the one that is current now, None: there is none. A choice of a person stands until the person gives the
    triad or kind back to the rule, or the chosen one is rejected or expires.
    """
    if verdict is not Verdict.PASS:
        return False
    return current is None or current.by_rule or bool(current.unusable(at))


def _shown(moment: datetime) -> str:
    return moment.strftime("%Y-%m-%d %H:%M UTC")
