"""One thread at a time imports what a start leaves for later.

Where two threads import modules of one package that import each other, as those of scipy do, Python lets one of them
see a module that is not complete, rather than wait for ever; the import then fails: a job that was resumed while the
service still loaded the filter of the unit's noise had no procedure.
"""

from threading import RLock

IMPORTING = RLock()
"""Held by whoever imports large modules within a function. A module never takes it while it is itself imported."""
