"""Clock of a bench with real devices: real time, which no step of the system's clock changes."""

from bench_service.wall_clock import monotonic_s, pause_async


class WallBenchClock:
    """Clock of a bench with real devices. Implements `procedures.bench.clock.Clock` by real time, or by that of served
    simulators at a time factor.
    """

    def __init__(self, passed_s: float = 0.0, factor: float = 1.0) -> None:
        """Begin at a bench time [s]: 0 for a job's first launch, later for one that continues after a restart.

        `factor`: bench seconds in a real second; 1 with any real device.
        """
        if not 0.0 < factor <= 10_000.0:
            raise ValueError(f"factor = {factor!r} must be above 0 and at most 10000")
        self._factor = factor
        self._zero_s = monotonic_s() - passed_s / factor

    def now_s(self) -> float:
        return (monotonic_s() - self._zero_s) * self._factor

    async def sleep(self, seconds: float) -> None:
        await pause_async(max(0.0, seconds) / self._factor)
