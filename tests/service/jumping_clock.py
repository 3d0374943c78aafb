"""A wall clock that jumps: what `bench_service.wall_clock` reads is put back or forward, in this process alone.

The monotonic clock goes on as it does, as a machine's does whose time is set.
"""

from datetime import datetime, timedelta, tzinfo
from types import SimpleNamespace
from uuid import UUID

import pytest
import uuid_utils

from bench_service import wall_clock

BELOW_TIME = 80
"""Bits of a UUID of version 7 below its milliseconds."""


class JumpingClock:
    """Replaces the one source of the present moment, and of ids, which begin with it."""

    def __init__(self, patch: pytest.MonkeyPatch) -> None:
        self.shift = timedelta()
        patch.setattr(wall_clock, "datetime", SimpleNamespace(now=self._now))
        patch.setattr(wall_clock, "uuid_utils", SimpleNamespace(uuid7=self._id))

    def jump(self, **by: float) -> None:
        """Set it forward, or back: `hours=-2`."""
        self.shift += timedelta(**by)

    def _now(self, zone: tzinfo) -> datetime:
        return datetime.now(zone) + self.shift

    def _id(self) -> UUID:
        milliseconds = self.shift // timedelta(milliseconds=1)
        return UUID(int=uuid_utils.uuid7().int + (milliseconds << BELOW_TIME))
