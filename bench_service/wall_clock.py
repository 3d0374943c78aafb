"""The only file that reads the real clock or makes an id from it."""

import time
from datetime import UTC, datetime

import uuid_utils


def now() -> datetime:
    """The present moment, with its time zone (UTC)."""
    return datetime.now(UTC)


def monotonic_s() -> float:
    """Seconds of a clock that is never set back."""
    return time.monotonic()  # noqa: TID251  the one place


def monotonic_at_s(moment: datetime) -> float:
    """Reading of `monotonic_s` at a moment, counted from now: a clock that is set back later does not move it."""
    return monotonic_s() + (moment - now()).total_seconds()


def pause(seconds: float) -> None:
    """Wait in real time, in this thread."""
    time.sleep(seconds)  # noqa: TID251  the one place


def new_id() -> str:
    """An id that sorts by the time of its making (UUID version 7)."""
    return str(uuid_utils.uuid7())


async def pause_async(seconds: float) -> None:
    """Wait in real time without holding the thread."""
    import asyncio  # here: `bench stop` begins without it

    await asyncio.sleep(seconds)  # noqa: TID251  the one place
