"""Tokens in texts: whatever records a text for later hides them first."""

import re

PREFIX = "bench_"
"""Beginning of every token, by which a person or a scanner of files knows it."""
SECRET_LENGTH = 43
"""Number of characters of a token after its beginning: 32 bytes in base 64."""
_TOKEN = re.compile(rf"{PREFIX}[A-Za-z0-9_-]{{{SECRET_LENGTH}}}")


def names_token(text: str) -> bool:
    """Return whether a text contains something in the form of an access token."""
    return _TOKEN.search(text) is not None


def without_tokens(text: str) -> str:
    """Return a text with every access token in it replaced: for log lines, traces and the audit trail."""
    return _TOKEN.sub(f"{PREFIX}[hidden]", text)
