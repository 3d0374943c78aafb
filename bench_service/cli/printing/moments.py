"""Format of the service's times on a terminal."""


def moment(text: str | None) -> str:
    """Return a time of the service as text to the second, in UTC; a dash for None."""
    return "–" if text is None else f"{text[:19].replace('T', ' ')} UTC"
