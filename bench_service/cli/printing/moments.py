"""Moments for a terminal."""


def moment(text: str | None) -> str:
    """Format a moment of the service to the second, in UTC."""
    return "–" if text is None else f"{text[:19].replace('T', ' ')} UTC"
