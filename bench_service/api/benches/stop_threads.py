"""Threads for stop requests: each has one of its own, so that no analysis, import or page request delays it."""

import asyncio
from functools import partial

from bench_service.background import in_background
from bench_service.jobs.stops import Stopped, StopService
from bench_service.model.errors import StorageFailure

PATIENT = 32
"""Number of simultaneous stops that wait for their outcome; further ones are passed on without waiting."""
LONGEST_S = 6.0
"""Longest time until a stop is answered, whatever holds its thread [s]."""

_waiting = 0


async def stop_in_own_thread(
    stops: StopService, bench_id: str, reason: str, by: str, key: str | None = None, *, wait: bool = True
) -> Stopped:
    """Run `StopService.stop` in a thread of its own, outside the pool of all other routes, and return its outcome.
    Raises what it raises, and `StorageFailure` where no thread can be made or none has answered within `LONGEST_S`.
    `wait`: be `patient` there, unless many stops wait already.
    """
    global _waiting
    _waiting += 1
    try:
        patient = wait and _waiting <= PATIENT
        work = partial(stops.stop, bench_id, reason, by, patient=patient, key=key)
        return await asyncio.wait_for(asyncio.wrap_future(in_background("stop", work)), LONGEST_S)
    except TimeoutError:
        raise StorageFailure(
            f"the stop of bench {bench_id!r} was passed on, and neither bench nor database has answered within "
            f"{LONGEST_S:g} s: press the hardware emergency stop, or run `bench stop` on the bench's host"
        ) from None
    finally:
        _waiting -= 1
