"""Time of a served world: a pause of the process is made up for, what is longer is given up and counted."""

import asyncio

import pytest

from simulators.served.pace import LONGEST_S, MADE_UP_S, STEP_S, Pace, PacedClock

RATE_HZ, FACTOR = 400.0, 10.0


class _Machine:
    """A real clock on which waiting is all that takes time, and which is held up at given moments."""

    def __init__(self, pauses: dict[float, float], end_s: float) -> None:
        self.now_s, self._pauses, self._end_s = 0.0, dict(pauses), end_s

    async def wait(self, seconds: float) -> None:
        self.now_s += seconds
        for at_s in [at_s for at_s in self._pauses if at_s <= self.now_s]:
            self.now_s += self._pauses.pop(at_s)
        if self.now_s >= self._end_s:
            raise TimeoutError


def _run(pauses: dict[float, float], end_s: float) -> tuple[float, float, list[int]]:
    """Bench time that passed, bench time that was given up, and the ticks of each step."""
    machine, clock, steps = _Machine(pauses, end_s), PacedClock(RATE_HZ), list[int]()
    clock.connect(steps.append)
    pace = Pace(clock, FACTOR, lambda: machine.now_s, machine.wait)
    with pytest.raises(TimeoutError):
        asyncio.run(pace.run())
    return clock.now_s(), pace.behind_s, steps


@pytest.mark.parametrize("pause_s", [0.0, 0.04, 0.3, 0.9])
def test_a_pause_is_made_up_for_in_steps(pause_s: float) -> None:
    passed_s, given_up_s, steps = _run({1.0: pause_s}, 3.0)
    assert given_up_s == 0.0
    assert passed_s == pytest.approx(3.0 * FACTOR, abs=2.0 * STEP_S * FACTOR)
    assert max(steps) <= LONGEST_S * RATE_HZ * FACTOR


def test_what_is_longer_than_that_is_given_up_and_counted() -> None:
    passed_s, given_up_s, _ = _run({1.0: 2.5, 5.0: 1.2}, 8.0)
    expected_s = (2.5 + 1.2 - 2.0 * MADE_UP_S) * FACTOR
    assert given_up_s == pytest.approx(expected_s, abs=4.0 * STEP_S * FACTOR)
    assert passed_s + given_up_s == pytest.approx(8.0 * FACTOR, abs=2.0 * STEP_S * FACTOR)
