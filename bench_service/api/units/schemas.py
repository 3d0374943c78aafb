"""Schemas of units and their corrections. Units of measurement are in the field names."""

from datetime import datetime
from typing import Annotated

from pydantic import BaseModel, Field

from bench_service.api.http.fields import NAME, Request
from bench_service.api.units.calibration_schemas import DecisionView, Remark
from bench_service.evidence.corrections import StoredCorrection
from bench_service.mapping import copied
from bench_service.model.calibrations import Approval
from bench_service.wall_clock import now
from procedures.core.converter import ConverterTriad
from procedures.core.limits import Verdict
from procedures.core.recording import Channel
from procedures.core.temperature.gyros import GyroThermalCorrection
from procedures.core.temperature.thermometers import ThermometerCorrection
from procedures.core.thermal_correction import ThermalCorrection
from procedures.core.unit import TriadRecord, Unit
from procedures.core.unit_correction import CorrectionKind


class UnitDeclaration(Request):
    """The declaration of a unit (its data sheet); its serial stands in the address."""

    sample_rate_hz: float = Field(gt=0, le=1e6, allow_inf_nan=False)
    channels: list[Channel] = Field(default_factory=list[Channel], max_length=64)
    gyro: TriadRecord | None = None
    accelerometer: TriadRecord | None = None
    averaging_time_s: float = Field(70.0, gt=0, le=1e6, allow_inf_nan=False)


class UnitView(BaseModel):
    """The declared record of a unit."""

    serial: str
    sample_rate_hz: float
    channels: list[Channel]
    gyro: TriadRecord | None
    accelerometer: TriadRecord | None
    averaging_time_s: float
    gyro_calibration: str | None = Field(description="Id of the gyros' current calibration, where it may be used")
    accelerometer_calibration: str | None = Field(
        description="Id of the accelerometers' current calibration, where it may be used"
    )
    withheld: list[str] = Field(description="Why a current calibration may not be used, and the way out")
    thermal_correction: str | None = Field(description="Id of the current correction of the kind `thermal`")
    converter: str | None = Field(description="Id of the current correction of the kind `converter`")
    thermometers: str | None = Field(description="Id of the current correction of the kind `thermometers`")
    gyro_correction: str | None = Field(description="Id of the current correction of the kind `gyros`")

    @classmethod
    def of(cls, unit: Unit) -> "UnitView":
        return copied(
            cls,
            unit,
            gyro_calibration=unit.calibration_id("gyro"),
            accelerometer_calibration=unit.calibration_id("accelerometer"),
            withheld=[entry.why for entry in unit.withheld],
            thermal_correction=unit.thermal_correction_id,
            converter=unit.converter_id,
            thermometers=unit.thermometers_id,
            gyro_correction=unit.gyro_correction_id,
        )


class CorrectionView(BaseModel):
    """A correction set in a unit's history."""

    id: str
    unit: str
    kind: CorrectionKind
    result: str
    verdict: Verdict = Field(description="Verdict of the result that gave it")
    made_at: datetime
    current: bool
    by_rule: bool = Field(description="Whether the rule made it current, not a person; false while it is not current")
    not_current: str = Field(description="Why it is not current, and the way out; empty where it is")
    simulated: bool
    thermal: ThermalCorrection | None = Field(description="Thesis 4.1, of the kind `thermal`; else null")
    converter: ConverterTriad | None = Field(description="Models of x, y, z, of the kind `converter`; else null")
    thermometers: ThermometerCorrection | None = Field(description="Sensors, of the kind `thermometers`; else null")
    gyros: GyroThermalCorrection | None = Field(description="Polynomials of x, y, z, of the kind `gyros`; else null")
    approval: Approval
    valid_until: datetime | None
    unusable: str = Field(description="Why it may not be used now, and the way out; empty where it may")
    decisions: list[DecisionView]
    results: list[str] | None = Field(
        None, description="Results that rest on the correction, in the answer about this one alone"
    )

    @classmethod
    def of(cls, stored: StoredCorrection, results: tuple[str, ...] | None = None) -> "CorrectionView":
        return copied(
            cls,
            stored,
            stored.correction,
            result=stored.result_id,
            not_current=stored.why_not_current,
            unusable=stored.unusable(now()),
            decisions=[DecisionView.of(d) for d in stored.decisions],
            results=results,
        )


class CorrectionChoice(Request):
    """Request to make a correction set the one that counts."""

    by: Annotated[str, NAME] | None = Field(None, description="Person who decides; null: the client's name")
    remark: Remark = Field("", description="Needed for a correction of a result that did not pass")


class CorrectionRuleChoice(CorrectionChoice):
    """Request to give a kind of correction back to the rule."""

    kind: CorrectionKind = Field(description="Kind whose newest usable correction by a job that passed is to count")


class CorrectionPage(BaseModel):
    """One page of a unit's correction sets, newest first."""

    items: list[CorrectionView]
    next: str | None
