"""Conditions by which lists of jobs, recordings and results are searched."""

from dataclasses import dataclass
from datetime import datetime

from procedures.core.limits import Verdict


@dataclass(frozen=True)
class LabelSought:
    """A label that a job must have, and its value where only one value is accepted."""

    name: str
    value: str | None = None

    @classmethod
    def parse(cls, text: str) -> "LabelSought":
        """Return the condition that `name` or `name=value` states; the name ends at the first equals sign."""
        name, equals, value = text.partition("=")
        return cls(name, value if equals else None)


@dataclass(frozen=True)
class Search:
    """Conditions that must all hold; one that is None or empty does not restrict the list.

    A recording and a result that belong to a job have that job's labels; a recording has its verdict too.
    """

    verdict: Verdict | None = None
    since: datetime | None = None
    """Made at this moment or later."""
    until: datetime | None = None
    """Made before this moment."""
    labels: tuple[LabelSought, ...] = ()
    text: str | None = None
    """A part of an id, a name or a label. Capital and small letters are the same; on SQLite only those of ASCII."""


EVERYTHING = Search()
