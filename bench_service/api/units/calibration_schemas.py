"""Schemas of calibrations: what a client sees of them, and what it enters and decides."""

from datetime import datetime
from typing import Annotated, Any, Literal

from pydantic import AwareDatetime, BaseModel, Field

from bench_service.api.http.fields import NAME, Request
from bench_service.api.results import Lineage
from bench_service.evidence.entered_calibrations import EnteredCoefficient, Entry
from bench_service.mapping import copied
from bench_service.model.calibrations import Act, Approval, Coefficient, Decision, StoredCalibration
from bench_service.model.records import StoredResult
from bench_service.wall_clock import now
from procedures.core.imu_model import TriadCalibration
from procedures.core.limits import Verdict

Triad = Literal["gyro", "accelerometer"]
Finite = Annotated[float, Field(allow_inf_nan=False, ge=-1e12, le=1e12)]
Remark = Annotated[str, Field(max_length=500)]


class CoefficientEntry(Request):
    """A coefficient of ``U = b + K·v`` as it is known."""

    name: str = Field(pattern=r"^(b_[xyz]|K[123][123])$", description="b_x, K11, … K33")
    value: Finite
    unit: str = Field(
        min_length=1,
        max_length=30,
        description="unit of b: rad/s, deg/h, m/s^2, µg or count; of K 1 or ppm, or count/(rad/s), count/(m/s^2)",
    )
    standard_uncertainty: float = Field(
        ge=0.0,
        le=1e12,
        allow_inf_nan=False,
        description="standard uncertainty in the same unit; 0 for a coefficient that is fixed by definition",
    )


class CalibrationEntry(Request):
    """Known coefficients of one triad: a passport's, a certificate's, a paper's."""

    triad: Triad
    origin: str = Field(min_length=1, max_length=1000, description="Source of the numbers: passport 17, table 5.1, …")
    coefficients: list[CoefficientEntry] = Field(min_length=12, max_length=12)
    correlations: list[Annotated[list[Finite], Field(min_length=12, max_length=12)]] | None = Field(
        None, min_length=12, max_length=12, description="In the order b_x, K11, K12, K13, b_y, …; null: uncorrelated"
    )
    measured_at: AwareDatetime | None = Field(None, description="When the coefficients were measured; null: not known")
    valid_from: AwareDatetime | None = None
    valid_until: AwareDatetime | None = Field(None, description="End of their validity; null: they have none")
    choose: bool = Field(False, description="Whether it becomes the triad's current calibration at once")
    by: Annotated[str, NAME] | None = Field(None, description="Person who enters it; null: the client's name")
    remark: Remark = ""

    def entry(self) -> Entry:
        """Return the entry in the form that `evidence.entered_calibrations` takes."""
        return copied(
            Entry,
            self,
            coefficients=tuple(copied(EnteredCoefficient, c) for c in self.coefficients),
            correlations=None if self.correlations is None else tuple(map(tuple, self.correlations)),
        )


class CalibrationChoice(Request):
    """Request to make a calibration the one that counts."""

    by: Annotated[str, NAME] | None = Field(None, description="Person who decides; null: the client's name")
    remark: Remark = Field("", description="Needed for a calibration of a result that did not pass")


class RuleChoice(CalibrationChoice):
    """Request to give a triad back to the rule."""

    triad: Triad


class CalibrationApproval(Request):
    """Approval of a calibration, with the end of its validity where one is given."""

    by: Annotated[str, NAME] | None = Field(None, description="Person who decides; null: the client's name")
    remark: Remark = ""
    valid_until: AwareDatetime | None = Field(None, description="End of the validity; null: unchanged")


class CalibrationRejection(Request):
    """Rejection of a calibration, with the reason."""

    by: Annotated[str, NAME] | None = Field(None, description="Person who decides; null: the client's name")
    remark: str = Field(min_length=1, max_length=500, description="Why it may not be used")


class CoefficientView(BaseModel):
    """One coefficient: subject, name, value, unit, standard uncertainty."""

    subject: str = Field(description="gyro or accelerometer")
    name: str = Field(description="b_x, K11, …")
    value: float
    unit: str
    standard_uncertainty: float

    @classmethod
    def of(cls, coefficient: Coefficient) -> "CoefficientView":
        return copied(cls, coefficient)


class DecisionView(BaseModel):
    """A decision about a calibration."""

    act: Act
    at: datetime
    by: str = Field(description="Name of the person; empty: the rule")
    proven: bool = Field(description="Whether the person was authenticated; else the name was declared")
    remark: str

    @classmethod
    def of(cls, decision: Decision) -> "DecisionView":
        return copied(cls, decision)


class CalibrationView(BaseModel):
    """A calibration of one triad in a unit's history."""

    id: str
    unit: str
    triad: str
    method: str = Field(description="Procedure or method that gave it, or `entered`")
    origin: str = Field(description="Source of entered coefficients; empty where `result` is the origin")
    result: str | None = Field(description="Result that gave it; null for an entered one")
    verdict: Verdict | None = Field(description="Verdict of that result; null for an entered one")
    made_at: datetime
    simulated: bool
    current: bool = Field(description="Whether it is the current one of its triad")
    by_rule: bool = Field(description="Whether the rule made it current; else a person chose it")
    approval: Approval
    valid_from: datetime | None
    valid_until: datetime | None
    unusable: str = Field(description="Why it may not be used now, and the way out; empty where it may")
    calibration: TriadCalibration = Field(description="b, K and the covariance of all twelve")
    coefficients: list[CoefficientView] = Field(description="In the order of the covariance")
    decisions: list[DecisionView] = Field(description="Oldest first")

    @classmethod
    def of(cls, stored: StoredCalibration, **more: Any) -> "CalibrationView":
        return copied(
            cls,
            stored,
            result=stored.result_id,
            unusable=stored.unusable(now()),
            calibration=stored.value,
            coefficients=[CoefficientView.of(c) for c in stored.coefficients],
            decisions=[DecisionView.of(d) for d in stored.decisions],
            **more,
        )


class CalibrationDetail(CalibrationView):
    """A calibration with its lineage and its use."""

    lineage: Lineage | None = Field(description="Lineage of the result that gave it; null for an entered one")
    results: list[str] = Field(description="Results that rest on it, newest first")

    @classmethod
    def of_use(
        cls, stored: StoredCalibration, made_by: StoredResult | None, used_by: tuple[str, ...]
    ) -> "CalibrationDetail":
        """Convert a calibration with the result that gave it and those that used it."""
        lineage = None if made_by is None else Lineage.of(made_by)
        return copied(cls, CalibrationView.of(stored), lineage=lineage, results=list(used_by))


class CalibrationPage(BaseModel):
    """One page of a unit's calibrations, newest first."""

    items: list[CalibrationView]
    next: str | None
