"""Answers about correction sets. Units are in the field names, or those that `procedures.core` states."""

from datetime import datetime

from pydantic import BaseModel, Field

from bench_service.jobs.corrections import StoredCorrection
from procedures.core.converter import ConverterTriad
from procedures.core.thermal_correction import ThermalCorrection
from procedures.core.unit_correction import CorrectionKind


class CorrectionView(BaseModel):
    """A correction set in a unit's history."""

    id: str
    unit: str
    kind: CorrectionKind
    result: str
    made_at: datetime
    current: bool
    simulated: bool
    thermal: ThermalCorrection | None = Field(description="Thesis 4.1, of the kind `thermal`; else null")
    converter: ConverterTriad | None = Field(description="Models of x, y, z, of the kind `converter`; else null")
    results: list[str] | None = Field(None, description="Results that rest on it; only where one is asked for")

    @classmethod
    def of(cls, stored: StoredCorrection, results: tuple[str, ...] | None = None) -> "CorrectionView":
        return cls(
            id=stored.id,
            unit=stored.unit,
            kind=stored.correction.kind,
            result=stored.result_id,
            made_at=stored.made_at,
            current=stored.current,
            simulated=stored.simulated,
            thermal=stored.correction.thermal,
            converter=stored.correction.converter,
            results=None if results is None else list(results),
        )


class CorrectionPage(BaseModel):
    """Correction sets of a unit, newest first."""

    items: list[CorrectionView]
    next: str | None
