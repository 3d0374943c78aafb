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
    """A demand beyond a limit: refused before anything moves."""


class NotSettled(BenchError):
    """The table did not come to rest in time."""


class SoakNotReached(BenchError):
    """The chamber or the unit's temperatures did not come to rest in the time that a leg of a profile allows."""


class NotPowered(BenchError):
    """A reading was asked of a unit that is switched off."""


class DeviceFault(BenchError):
    """A device reports a fault."""


class Disconnected(BenchError):
    """A device does not answer."""


class DeviceBusy(BenchError):
    """Another process has the device's link, which admits one master."""


class OtherVersion(BenchError):
    """The bench cannot continue from a state that another version of it stored."""


class Stopped(BenchError):
    """An operator's stop or cancel ended the work."""
