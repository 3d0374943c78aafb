"""One thread at a time imports what a start leaves for later.

Where two threads import modules of one package that import each other, as those of scipy do, Python lets one of them
see a module that is not complete, rather than wait for ever, and its import fails. Without this lock the file of a
procedure could not be imported while another thread loaded the filter of the unit's noise, and its job failed.
"""

from threading import RLock

IMPORTING = RLock()
"""Held by whoever imports large modules within a function. A module never takes it while it is itself imported."""
