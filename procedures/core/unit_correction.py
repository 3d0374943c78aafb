"""A correction set of a unit, as it is kept in the unit's history: its kind and its value.

A calibration describes a unit at one temperature; a correction describes its departure from that, or its thermometers.
"""

from dataclasses import dataclass
from typing import Literal

from procedures.core.converter import ConverterTriad
from procedures.core.errors import BadParameter
from procedures.core.temperature.gyros import GyroThermalCorrection
from procedures.core.temperature.thermometers import ThermometerCorrection
from procedures.core.thermal_correction import ThermalCorrection

CorrectionKind = Literal["thermal", "converter", "thermometers", "gyros"]


@dataclass(frozen=True)
class UnitCorrection:
    """Temperature correction of a unit, found by one job. Raises `BadParameter` where kind and value disagree."""

    kind: CorrectionKind
    """Kind "thermal" for the accelerometer triad (thesis 4.1), "converter" for the converter (thesis 3.8-3.13),
    "thermometers" for the unit's temperature sensors, "gyros" for gyros that depend on temperature."""
    value: ThermalCorrection | ConverterTriad | ThermometerCorrection | GyroThermalCorrection
    """A `ThermalCorrection`, three `ConverterModel`s, a `ThermometerCorrection`, or a `GyroThermalCorrection`."""

    def __post_init__(self) -> None:
        belongs = "converter"
        if isinstance(self.value, ThermalCorrection):
            belongs = "thermal"
        elif isinstance(self.value, ThermometerCorrection):
            belongs = "thermometers"
        elif isinstance(self.value, GyroThermalCorrection):
            belongs = "gyros"
        if self.kind != belongs:
            raise BadParameter("kind", self.kind, f"{belongs!r}, as the value is")

    @property
    def thermal(self) -> ThermalCorrection | None:
        """The value of the kind "thermal", else None."""
        return self.value if isinstance(self.value, ThermalCorrection) else None

    @property
    def converter(self) -> ConverterTriad | None:
        """The value of the kind "converter", else None."""
        return self.value if isinstance(self.value, tuple) else None

    @property
    def thermometers(self) -> ThermometerCorrection | None:
        """The value of the kind "thermometers", else None."""
        return self.value if isinstance(self.value, ThermometerCorrection) else None

    @property
    def gyros(self) -> GyroThermalCorrection | None:
        """The value of the kind "gyros", else None."""
        return self.value if isinstance(self.value, GyroThermalCorrection) else None
