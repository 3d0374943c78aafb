"""Retries while a service is away for a while: restarted, or behind a link that is down."""

from collections.abc import Callable
from typing import TypeVar

from bench_service.cli.refusal import Away, Refused
from bench_service.wall_clock import monotonic_s, now, pause

AWAY_S = 60.0
"""Time for which a service may be away [s]; a restart takes a few seconds."""
AGAIN_S = 0.5
"""Interval between two retries [s]."""

Found = TypeVar("Found")


def with_retries(ask: Callable[[], Found], say: Callable[[str], object], goes_on: str) -> Found:
    """Call `ask` and return its answer; retry while the service is away. `ask` must change nothing.

    `goes_on`: sentence on what becomes of the job or run when retries end, and how to look at it again.
    Raises `Refused` with it after `AWAY_S`, and any other exception of `ask` at once.
    """
    begun, begun_s = now(), monotonic_s()
    said = False
    while True:
        try:
            found = ask()
        except Away as error:
            if monotonic_s() - begun_s > AWAY_S:
                raise Refused(f"{error}; waited for {AWAY_S:.0f} s. {goes_on}") from error
            if not said:
                say(f"{error}; waiting since {begun:%H:%M:%S} UTC, for {AWAY_S:.0f} s at most")
                said = True
            pause(AGAIN_S)
            continue
        if said:
            say("the service answers again")
        return found
