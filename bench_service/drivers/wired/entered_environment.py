"""Room conditions that a person entered in the bench file: implements `procedures.bench.environment.Environment`."""

from bench_service.drivers.interface.sections import EnvironmentSection
from procedures.bench.clock import Clock
from procedures.bench.device import DeviceIdentity
from procedures.bench.environment import EnvironmentReading


class EnteredEnvironment:
    """Room conditions that a person entered in the bench file, the same at any time. Implements
    `procedures.bench.environment.Environment`.
    """

    def __init__(self, section: EnvironmentSection, clock: Clock) -> None:
        self._section = section
        self._clock = clock

    async def identify(self) -> DeviceIdentity:
        """Return an identity that only says that the values were entered."""
        return DeviceIdentity(model="entered in the bench file")

    async def read(self) -> EnvironmentReading:
        """Return the entered temperature, humidity and pressure, at the present bench time."""
        s = self._section
        return EnvironmentReading(self._clock.now_s(), s.temperature_c, s.humidity_percent, s.pressure_hpa)
