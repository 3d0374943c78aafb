"""Interface of the room's conditions: a sensor, or what a person entered."""

from dataclasses import dataclass
from typing import Protocol

from procedures.bench.device import Device


@dataclass(frozen=True)
class EnvironmentReading:
    """Conditions of the room at one moment; None: not measured."""

    time_s: float
    """Bench time of the reading [s]; its age is the clock's time less this."""
    temperature_c: float | None = None
    humidity_percent: float | None = None
    """Relative humidity of the air."""
    pressure_hpa: float | None = None


class Environment(Device, Protocol):
    """Sensor of the room around the bench: temperature, humidity, pressure. Interface."""

    async def read(self) -> EnvironmentReading:
        """Return the room's temperature, humidity and pressure; None for what is not measured. Raises
        `Disconnected`.
        """
        ...
