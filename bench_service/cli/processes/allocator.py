"""The C library's allocator in processes that run for months: freed memory is used again or given back.

glibc gives a thread that finds all arenas busy a new one, up to eight a core, and memory freed in one is not used for
another. The job engine works each job in threads of its own: the parts of a calibration's analysis end up in sixteen
arenas that each grow to their own maximum. It also takes blocks of up to 32 MB from the heap once a larger one has
been freed; a small block that is placed behind them keeps them from being given back. Nothing is lost, but resident
memory creeps up for hours. (Blocks of 128 kB, the threshold at the start, would all be mapped one by one: sums over a
record then take twice the processor time; above 4 MB the difference is 5 %.)

`MALLOC_ARENA_MAX`, `MALLOC_MMAP_THRESHOLD_` and `MALLOC_TRIM_THRESHOLD_` in the environment are glibc's own settings
for the same, and come first.
"""

import ctypes
import os

ARENAS = 2
"""Maximum number of arenas: one for the bench's thread and one for the rest."""
MAPPED_BYTES = 4 << 20
"""Size from which a block is mapped apart from the heap, and given back when it is freed."""
TRIMMED_BYTES = 8 << 20
"""Free memory at the heap's end from which it is given back."""
_PARAMETERS = (
    ("MALLOC_ARENA_MAX", -8, ARENAS),
    ("MALLOC_MMAP_THRESHOLD_", -3, MAPPED_BYTES),
    ("MALLOC_TRIM_THRESHOLD_", -1, TRIMMED_BYTES),
)
"""Of each: glibc's setting, the number of the parameter in its `malloc.h`, and our value."""


def limit_allocator() -> bool:
    """Set the allocator of this process from now on; True where its C library takes all that is set.

    To be called before threads are begun: arenas that are there stay.
    """
    try:
        set_parameter = ctypes.CDLL(None).mallopt
    except (OSError, AttributeError):  # another C library: it has no arenas of this kind
        return False
    taken = [set_parameter(number, value) for name, number, value in _PARAMETERS if name not in os.environ]
    return all(taken)
