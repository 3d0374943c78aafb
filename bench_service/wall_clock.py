"""The only file that reads the real clock or makes an id from it."""

import time
from datetime import UTC, datetime

import uuid_utils


def now() -> datetime:
    """Return the present moment of the real clock, in UTC."""
    return datetime.now(UTC)


def monotonic_s() -> float:
    """Return the seconds of a clock that is never set back."""
    return time.monotonic()  # noqa: TID251  the one place


def monotonic_at_s(moment: datetime) -> float:
    """Return the reading that `monotonic_s` has at a moment, counted from now: a clock that is set back later does not
    move it.
    """
    return monotonic_s() + (moment - now()).total_seconds()


def pause(seconds: float) -> None:
    """Wait in real time [s], and hold this thread."""
    time.sleep(seconds)  # noqa: TID251  the one place


def new_id() -> str:
    """Return a new id that sorts by the time of its making (UUID version 7)."""
    return str(uuid_utils.uuid7())


async def pause_async(seconds: float) -> None:
    """Wait in real time [s] without holding the thread."""
    import asyncio  # here: `bench stop` begins without it

    await asyncio.sleep(seconds)  # noqa: TID251  the one place
