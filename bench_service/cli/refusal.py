"""Exceptions of a command that cannot do its work."""


class Refused(Exception):
    """The service refused, or cannot be reached; the message is meant for a person."""


class Away(Refused):
    """The service is away: no answer, a proxy's error, or a service that is not ready; a retry may help."""
