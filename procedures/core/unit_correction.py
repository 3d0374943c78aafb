"""A correction set of a unit, as it is kept in the unit's history: its kind and its value.

A calibration describes a unit at one temperature; a correction describes its departure from that.
"""

from dataclasses import dataclass
from typing import Literal

from procedures.core.converter import ConverterTriad
from procedures.core.errors import BadParameter
from procedures.core.thermal_correction import ThermalCorrection

CorrectionKind = Literal["thermal", "converter"]


@dataclass(frozen=True)
class UnitCorrection:
    """Temperature correction of a unit, found by one job. Raises `BadParameter` where kind and value disagree."""

    kind: CorrectionKind
    """Kind "thermal" for the accelerometer triad (thesis 4.1), "converter" for the converter (thesis 3.8-3.13)."""
    value: ThermalCorrection | ConverterTriad
    """A `ThermalCorrection`, or three `ConverterModel`s, x, y, z."""

    def __post_init__(self) -> None:
        belongs = "thermal" if isinstance(self.value, ThermalCorrection) else "converter"
        if self.kind != belongs:
            raise BadParameter("kind", self.kind, f"{belongs!r}, as the value is")

    @property
    def thermal(self) -> ThermalCorrection | None:
        """The value of the kind "thermal", else None."""
        return self.value if isinstance(self.value, ThermalCorrection) else None

    @property
    def converter(self) -> ConverterTriad | None:
        """The value of the kind "converter", else None."""
        return None if isinstance(self.value, ThermalCorrection) else self.value
