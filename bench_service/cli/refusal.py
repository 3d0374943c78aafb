"""Exceptions of a command that cannot do its work."""


class Refused(Exception):
    """Raised where the service refuses, or cannot be reached; the message is meant for a person. The command ends with
    exit code 2.
    """


class Away(Refused):
    """Raised where the service does not answer for a while: no answer, a proxy's error, or a service that is not ready;
    a retry may help.
    """
