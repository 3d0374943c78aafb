"""The C library's allocator in processes that run for months: few arenas, so that freed memory is used again.

glibc gives a thread that finds all arenas busy a new one, up to eight a core, and memory freed in one is not used for
another. The job engine works each job in threads of its own: the parts of a calibration's analysis end up in sixteen
arenas that each grow to their own maximum. Nothing is lost, but resident memory creeps up for hours.

`MALLOC_ARENA_MAX` in the environment is glibc's own setting for the same, and comes first.
"""

import ctypes
import os

ARENAS = 2
"""Maximum number of arenas: one for the bench's thread and one for the rest."""
_M_ARENA_MAX = -8
"""The number of this parameter in glibc's `malloc.h`."""


def few_arenas() -> bool:
    """Limit the arenas of this process from now on; True where its C library takes the limit.

    To be called before threads are begun: arenas that are there stay.
    """
    if "MALLOC_ARENA_MAX" in os.environ:
        return True
    try:
        set_parameter = ctypes.CDLL(None).mallopt
    except (OSError, AttributeError):  # another C library: it has no arenas of this kind
        return False
    return bool(set_parameter(_M_ARENA_MAX, ARENAS))
