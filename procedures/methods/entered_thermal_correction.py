"""Thermal correction of the accelerometers from coefficients that are known: a passport, or thesis table 4.4.

Each coefficient has its uncertainty, and the whole an origin. Coefficients per code of a temperature sensor, as the
thesis prints them, need the sensor's codes per degree. The correction joins the unit's history; a person makes it
current (`POST /units/{serial}/corrections/{id}/current`).
"""

from typing import Annotated, Self

import numpy as np
from pydantic import Field, model_validator

from procedures.core.limits import Limit, check, verdict
from procedures.core.report import Report, Table
from procedures.core.thermal_correction import COEFFICIENTS, AxisCorrection, Form, TemperatureRange, ThermalCorrection
from procedures.core.unit import Unit
from procedures.core.unit_correction import UnitCorrection
from procedures.parameters import Parameters
from procedures.procedure import Evidence, Method, Outcome

Four = Annotated[tuple[float, float, float, float], Field(description="in thesis 4.1's order, a degree")]
Spread = Annotated[float, Field(ge=0.0)]
Range = Annotated[tuple[float, float], Field(description="[°C], the lower one first")]
FourSpreads = tuple[Spread, Spread, Spread, Spread]
POWERS = np.array([2, 1, 2, 1, 1, 2, 1, 2])
"""Power of the sensor's reading that each α and β multiplies: α1 α2 α3 α4 β1 β2 β3 β4 of thesis 4.1."""
OF_CONVERTER = np.array([False, False, True, True, False, False, True, True])


class Axis(Parameters):
    """Known coefficients of one accelerometer (thesis 4.1): α in 1/°C and 1/°C², β in m/s² a °C and °C²."""

    scale: float = Field(gt=0.0, le=1e3, description="K0")
    bias_m_s2: float = Field(ge=-1e3, le=1e3, description="B0, which is added")
    alpha: Four
    beta: Four
    alpha_sd: FourSpreads = Field(description="standard uncertainties; 0: fixed by definition")
    beta_sd: FourSpreads


class Params(Parameters):
    """The coefficients with their uncertainties and their origin."""

    origin: str = Field(min_length=3, max_length=300, pattern=r"\S", description="passport, certificate or table")
    axes: tuple[Axis, Axis, Axis] = Field(description="x, y, z")
    case_codes_per_c: float = Field(1.0, gt=0.0, le=1e9, description="1: coefficients a degree; else a code")
    converter_codes_per_c: float = Field(1.0, gt=0.0, le=1e9)
    case_reference_c: float = Field(20.0, ge=-100.0, le=200.0, description="where the correction does nothing")
    converter_reference_c: float = Field(20.0, ge=-100.0, le=200.0)
    case_range_c: Range | None = Field(None, description="readings at which they were found; both ranges or none")
    converter_range_c: Range | None = Field(
        None, description="[°C]; without ranges no use of the correction can warn that it extrapolates"
    )
    form: Form = Form.BOTH

    @model_validator(mode="after")
    def _ranges(self) -> Self:
        if (self.case_range_c is None) != (self.converter_range_c is None):
            raise ValueError("case_range_c and converter_range_c: both or none")
        for name, span in (("case_range_c", self.case_range_c), ("converter_range_c", self.converter_range_c)):
            if span is not None and not span[0] <= span[1]:
                raise ValueError(f"{name} = {span[0]:g}, {span[1]:g}: the lower temperature first")
        return self

    @property
    def fitted_range(self) -> TemperatureRange | None:
        """Temperature range of both sensors; None where it is not known."""
        if self.case_range_c is None or self.converter_range_c is None:
            return None
        return TemperatureRange(self.case_range_c, self.converter_range_c)


class Result(Outcome):
    """The correction as it is stored, a degree."""

    origin: str
    correction: ThermalCorrection


def analyse(evidence: Evidence, params: Params, unit: Unit | None) -> Result:
    """Return the correction converted to degrees. Raises `BadParameter`."""
    axes = (_axis(params, 0), _axis(params, 1), _axis(params, 2))
    found = ThermalCorrection("accelerometer", axes, fitted_range=params.fitted_range)
    given = float(sum(np.count_nonzero([*a.alpha, *a.beta]) for a in params.axes))
    limit = Limit("1", minimum=1.0, source="ours: a correction of zeros corrects nothing")
    checks = (check("coefficients that are not zero", given, limit),)
    return Result(checks=checks, verdict=verdict(checks), origin=params.origin, correction=found)


def report(result: Result) -> Report:
    """Return the report: coefficients a degree, with their uncertainties and their origin."""
    rows = tuple(
        (axis, name, value, sd)
        for axis, one in zip("xyz", result.correction.axes, strict=True)
        for name, value, sd in zip(
            COEFFICIENTS, (*one.alpha, *one.beta), one.standard_uncertainties().tolist(), strict=True
        )
    )
    columns = ("axis", "coefficient", "value", "± standard uncertainty")
    return Report(sections=(Table("Thermal correction as entered", columns, rows, f"Origin: {result.origin}."),))


def corrections(result: Result) -> tuple[UnitCorrection, ...]:
    """Return the correction for the unit's history."""
    return (UnitCorrection("thermal", result.correction),)


def _axis(params: Params, number: int) -> AxisCorrection:
    a = params.axes[number]
    size = np.where(OF_CONVERTER, params.converter_codes_per_c, params.case_codes_per_c) ** POWERS
    values = (np.array([*a.alpha, *a.beta]) * size).tolist()
    spreads = np.array([*a.alpha_sd, *a.beta_sd]) * size
    covariance = tuple(tuple(row) for row in np.diag(spreads**2).tolist())
    return AxisCorrection(
        a.scale,
        a.bias_m_s2,
        (values[0], values[1], values[2], values[3]),
        (values[4], values[5], values[6], values[7]),
        params.case_reference_c,
        params.converter_reference_c,
        params.form,
        covariance=covariance,
    )


METHOD = Method(
    *("entered_thermal_correction", "Thermal correction from known coefficients", "1.1.0"),
    *(Params, Result, analyse, report),
    corrections=corrections,
)
