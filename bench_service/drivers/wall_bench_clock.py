"""Clock of a bench with real devices: real time, which no step of the system's clock changes."""

from bench_service.wall_clock import monotonic_s, pause_async


class WallBenchClock:
    """Implements `procedures.bench.clock.Clock` by real time."""

    def __init__(self, passed_s: float = 0.0) -> None:
        """Begin at a bench time [s]: 0 for a job's first launch, later for one that goes on after a restart."""
        self._zero_s = monotonic_s() - passed_s

    def now_s(self) -> float:
        return monotonic_s() - self._zero_s

    async def sleep(self, seconds: float) -> None:
        await pause_async(max(0.0, seconds))
