"""Simulated time in whole sample intervals ("ticks"); sleeping on it moves the world.

Knows how long a tick is and whom to call when ticks pass; does not know what they do with them.
"""

from collections.abc import Awaitable, Callable, Generator
from dataclasses import dataclass
from math import ceil
from types import coroutine

import numpy as np
from numpy.typing import NDArray

from procedures.bench.errors import OutOfRange

SLICE_S = 10.0
"""Longest bench time between two points at which a job can be cancelled [s]."""
REAL_TIME_SLICE_S = 0.1
"""Longest real time between two such points, where the clock is asked to keep pace with real time [s]."""

Wait = Callable[[float], Awaitable[None]]


@dataclass(frozen=True)
class Motion:
    """Motion that the unit went through during some ticks, in its own axes.

    Increments per tick, shape (ticks, 3), or (1, 3) where every tick is alike: `angle_rad` the integral of inertial
    angular rate, `velocity_m_s` the integral of specific force.
    """

    ticks: int
    angle_rad: NDArray[np.float64]
    velocity_m_s: NDArray[np.float64]


@coroutine
def _let_others_run() -> Generator[None, None, None]:
    """Suspend for no time: the caller that drives the coroutine may cancel it here."""
    yield


class SimClock:
    """Simulated clock; implements `procedures.bench.clock.Clock`. `connect` sets the function that moves the world."""

    def __init__(
        self,
        rate_hz: float,
        real_time_factor: float | None = None,
        wait: Wait | None = None,
        slice_s: float | None = None,
        follows: Callable[[], float] | None = None,
    ) -> None:
        """Start at tick 0. `real_time_factor`: bench seconds a real second, None: unlimited; `wait` waits real seconds.

        `slice_s`: instead of `SLICE_S`. `follows`: bench time of another clock [s], which sleeping keeps pace with and
        `catch_up` moves the world to; it comes with a `wait`, and without a factor.
        """
        if real_time_factor is not None and (not 0.0 < real_time_factor < float("inf") or wait is None):
            raise ValueError(f"real_time_factor = {real_time_factor!r} must be above zero and comes with a `wait`")
        if follows is not None and (real_time_factor is not None or wait is None):
            raise ValueError("a clock that follows another one comes with a `wait`, and has no real-time factor")
        self.rate_hz = rate_hz
        self.ticks = 0
        self._slice_s = slice_s
        self._factor = real_time_factor
        self._wait = wait
        self._follows = follows
        self._advance: Callable[[int], None] = lambda _ticks: None

    def connect(self, advance: Callable[[int], None]) -> None:
        """Set `advance(ticks)`, which moves the world: called for every slice of time, before `now_s` shows it."""
        self._advance = advance

    def now_s(self) -> float:
        """Current bench time [s]."""
        return self.ticks / self.rate_hz

    def ticks_in(self, seconds: float) -> int:
        """Smallest number of whole ticks that last `seconds` (up to a millionth of a tick). Raises `OutOfRange`."""
        if not 0.0 <= seconds < float("inf"):
            raise OutOfRange(f"seconds = {seconds!r} must be finite and not negative")
        return ceil(seconds * self.rate_hz - 1e-6)

    async def sleep(self, seconds: float) -> None:
        """Let the world continue for `seconds` of bench time, in slices."""
        await self.pass_ticks(self.ticks_in(seconds))

    async def pass_ticks(self, ticks: int) -> None:
        """Let the world continue for whole ticks; between slices a job can be cancelled."""
        longest = SLICE_S if self._slice_s is None else self._slice_s
        if self._factor is not None:
            longest = min(longest, REAL_TIME_SLICE_S * self._factor)
        if self._follows is not None:
            longest = min(longest, REAL_TIME_SLICE_S)
        longest_ticks = max(1, int(longest * self.rate_hz))
        await _let_others_run()
        while ticks > 0:
            step = min(ticks, longest_ticks)
            self.advance_world(step)
            ticks -= step
            if self._factor is not None and self._wait is not None:
                await self._wait(step / self.rate_hz / self._factor)
            elif self._follows is not None and self._wait is not None:
                await self._wait(max(0.0, self.now_s() - self._follows()))
            else:
                await _let_others_run()

    @property
    def following(self) -> bool:
        """Return whether time passes by another clock, whether or not anyone sleeps on this one."""
        return self._follows is not None

    def catch_up(self) -> None:
        """Move the world to the time of the clock that it follows, without waiting; nothing where it is ahead."""
        behind = 0 if self._follows is None else int((self._follows() - self.now_s()) * self.rate_hz)
        longest = max(1, int(SLICE_S * self.rate_hz))
        while behind > 0:
            self.advance_world(min(behind, longest))
            behind -= longest

    def advance_world(self, ticks: int) -> None:
        """Move the world by whole ticks, now."""
        self._advance(ticks)
        self.ticks += ticks
