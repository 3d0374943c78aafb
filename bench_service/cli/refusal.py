"""What a command says when it cannot do what was asked."""


class Refused(Exception):
    """The service refused, or cannot be reached; the message is fit for a person."""


class Away(Refused):
    """Nobody answers, or a proxy says so, or the service that it is not ready: it may answer again soon."""
