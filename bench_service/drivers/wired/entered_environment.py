"""Room conditions that a person entered in the bench file: implements `procedures.bench.environment.Environment`."""

from bench_service.drivers.interface.sections import EnvironmentSection
from procedures.bench.clock import Clock
from procedures.bench.device import DeviceIdentity
from procedures.bench.environment import EnvironmentReading


class EnteredEnvironment:
    """Gives the entered values at any time."""

    def __init__(self, section: EnvironmentSection, clock: Clock) -> None:
        self._section = section
        self._clock = clock

    async def identify(self) -> DeviceIdentity:
        """Nothing but that the values were entered."""
        return DeviceIdentity(model="entered in the bench file")

    async def read(self) -> EnvironmentReading:
        """The entered values; see the port."""
        s = self._section
        return EnvironmentReading(self._clock.now_s(), s.temperature_c, s.humidity_percent, s.pressure_hpa)
