"""Errors of an answer that every protocol and line shares."""


class BadAnswer(ValueError):
    """An answer that is none of the protocol: cut, garbled, or to another request. The line is out of step."""


class Refusal(Exception):
    """The device understood the request and said no; the message has its words or its code."""


def shown(data: bytes, longest: int = 60) -> str:
    """Show bytes of a line in a message, printable ones as they are."""
    text = data[:longest].decode("latin-1").encode("unicode_escape").decode("ascii")
    return f"'{text}'" + (" …" if len(data) > longest else "")
