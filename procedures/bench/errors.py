"""Errors that a bench can raise.

BenchError
├── OutOfRange      a demand beyond a limit: refused before anything moves, never clamped
├── NotSettled      the table did not come to rest in time
├── SoakNotReached  the unit's temperatures did not come to rest in time
├── NotPowered      a reading was asked of a unit that is switched off
├── DeviceFault     a device reports a fault; it is never reset by itself
├── Disconnected    a device does not answer
├── DeviceBusy      another process has the device's link, which admits one master
├── OtherVersion    the bench cannot continue from a state that another version of it stored
└── Stopped         an operator's stop or cancel ended the work
"""


class BenchError(Exception):
    """Base of all bench errors; the message is fit for a person."""


class OutOfRange(BenchError):
    """Raised for a demand beyond a limit, before anything moves; demands are never clamped."""


class NotSettled(BenchError):
    """Raised where the table did not come to rest in time."""


class SoakNotReached(BenchError):
    """Raised where the chamber or the unit's temperatures did not come to rest in the time that a leg of a profile
    allows.
    """


class NotPowered(BenchError):
    """Raised where a reading was asked of a unit that is switched off."""


class DeviceFault(BenchError):
    """Raised where a device reports a fault, refuses a demand, or reads back otherwise than commanded."""


class Disconnected(BenchError):
    """Raised where a device does not answer within its time-out, or its link is lost."""


class DeviceBusy(BenchError):
    """Raised where another process has the device's link, which admits one master."""


class OtherVersion(BenchError):
    """Raised where the bench cannot continue from a state that another version of it stored."""


class Stopped(BenchError):
    """Raised where an operator's stop or cancel ended the work."""
