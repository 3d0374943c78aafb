"""Remarks of people about a unit: what was seen on it, what was repaired, where it lies."""

from dataclasses import dataclass
from datetime import datetime


@dataclass(frozen=True)
class UnitNote:
    """A person's remark about a unit; it is never changed, and stays with the unit."""

    id: str
    unit: str
    at: datetime
    by: str
    proven: bool
    """True where the person had logged in; False: the name was declared."""
    text: str
