"""Limits on log-in attempts: a name is locked after repeated failures, longer each time; an address may try
`PER_MINUTE` times a minute.
"""

from collections import OrderedDict, deque
from datetime import datetime, timedelta
from threading import Lock

FREE = 5
"""Number of failures in a row after which a name is locked."""
FIRST, LONGEST = timedelta(minutes=1), timedelta(hours=1)
"""Duration of the first lock, doubled with each further failure, and of the longest one."""
FORGOTTEN = timedelta(days=1)
"""Time after which failures are forgotten."""
PER_MINUTE = 30
"""Number of attempts that one address has in a minute, whatever the names."""
ADDRESSES = 4096
"""Number of addresses that are remembered."""


def locked_until(failures: int, last_at: datetime) -> datetime | None:
    """Return the end of a name's lock after failures in a row, of which the last was at `last_at`; None where it is not
    locked.
    """
    if failures < FREE:
        return None
    return last_at + min(FIRST * 2 ** min(failures - FREE, 10), LONGEST)


class AttemptRate:
    """Counter of the log-in attempts of each address within the last minute, in the memory of one process."""

    def __init__(self) -> None:
        self._mutex = Lock()
        self._attempts: OrderedDict[str, deque[datetime]] = OrderedDict()

    def wait_s(self, address: str, at: datetime) -> float | None:
        """Count an attempt from an address and return None; where the address has had too many, count nothing and
        return the time to wait [s].
        """
        with self._mutex:
            seen = self._attempts.setdefault(address, deque())
            self._attempts.move_to_end(address)
            if len(self._attempts) > ADDRESSES:
                self._attempts.popitem(last=False)
            while seen and not timedelta(0) <= at - seen[0] < timedelta(minutes=1):
                seen.popleft()
            if len(seen) >= PER_MINUTE:
                return (seen[0] + timedelta(minutes=1) - at).total_seconds()
            seen.append(at)
            return None
