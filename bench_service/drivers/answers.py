"""Errors of an answer that every protocol and line shares."""


class BadAnswer(ValueError):
    """Raised for an answer that does not belong to the protocol: cut, garbled, or to another request. The line is out
    of step.
    """


class Refusal(Exception):
    """Raised where the device understood the request and refused it; the message has its words or its code."""


def shown(data: bytes, longest: int = 60) -> str:
    """Return bytes of a line as text for a message, printable ones as they are, at most `longest` characters."""
    text = data[:longest].decode("latin-1").encode("unicode_escape").decode("ascii")
    return f"'{text}'" + (" …" if len(data) > longest else "")
