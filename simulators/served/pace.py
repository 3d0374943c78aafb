"""The world's clock in step with real time: bench seconds pass by themselves, at a stated factor."""

import asyncio
from collections.abc import Callable

from simulators.clock import SimClock, Wait

STEP_S = 0.002
"""Real time between two steps of the world [s]."""
LONGEST_S = 0.05
"""Longest real time that one step makes up for [s]."""
MADE_UP_S = 1.0
"""Longest real time by which the world may be late and is still led to the present, step by step [s]: a busy machine
holds a process up for some tenths of a second, and a unit keeps its rate meanwhile. What is more is given up. A test
that must meet a motion under way at a high factor has less: there a pause that is made up for is a jump."""


class PacedClock(SimClock):
    """Clock on which waiting moves nothing: time passes by `go`, which wakes the waiting tasks."""

    def __init__(self, rate_hz: float) -> None:
        super().__init__(rate_hz)
        self._passed = asyncio.Event()

    async def pass_ticks(self, ticks: int) -> None:
        """Wait until whole ticks have passed."""
        until = self.ticks + ticks
        while self.ticks < until:
            await self._passed.wait()

    def go(self, ticks: int) -> None:
        """Let the world continue for whole ticks, and wake the waiting tasks."""
        self.advance_world(ticks)
        passed, self._passed = self._passed, asyncio.Event()
        passed.set()


class Pace:
    """Moves a clock by real time. What a slow machine cannot make up for is given up and counted."""

    def __init__(
        self, clock: PacedClock, factor: float, now_s: Callable[[], float], wait: Wait, made_up_s: float = MADE_UP_S
    ) -> None:
        """Set up; `factor`: bench seconds in a real one; `now_s`: real time; `wait`: waits real seconds."""
        if not 0.0 < factor <= 10_000.0:
            raise ValueError(f"time_factor = {factor!r} must be above 0 and at most 10000")
        self._clock, self._factor, self._now_s, self._wait = clock, factor, now_s, wait
        self._made_up_s = made_up_s
        self.behind_s = 0.0
        """Bench time that was given up because the machine was too slow [s]."""

    async def run(self) -> None:
        """Move the clock until cancelled."""
        begin, done = self._now_s(), 0
        rate = self._clock.rate_hz * self._factor
        most, made_up = max(1, int(LONGEST_S * rate)), max(1, int(self._made_up_s * rate))
        while True:
            await self._wait(STEP_S)
            due = int((self._now_s() - begin) * rate) - done
            if due > made_up:
                self.behind_s += (due - made_up) / self._clock.rate_hz
                done += due - made_up
            if due > 0:
                step = min(due, most)
                self._clock.go(step)
                done += step
