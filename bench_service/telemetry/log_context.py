"""The subject of log lines: bench, job, step, request. Set where it is known, read when a line is written."""

import logging
from collections.abc import Generator
from contextlib import contextmanager
from contextvars import ContextVar

_ABOUT: ContextVar[dict[str, str] | None] = ContextVar("about", default=None)


@contextmanager
def about(**subjects: str | None) -> Generator[None]:
    """Set the subjects of the lines logged inside: `bench`, `job`, its `step`, `campaign`, `campaign_step`, `request`.

    A subject that is None adds nothing.
    """
    known = {name: value for name, value in subjects.items() if value is not None}
    token = _ABOUT.set({**(_ABOUT.get() or {}), **known})
    try:
        yield
    finally:
        _ABOUT.reset(token)


def subjects() -> dict[str, str]:
    """Return the subjects of lines logged here and now, as name -> text."""
    return dict(_ABOUT.get() or {})


def request_id() -> str:
    """Return the id of the request that is being answered; empty outside of requests."""
    return (_ABOUT.get() or {}).get("request", "")


class AddSubjects(logging.Filter):
    """Adds the subjects to a log record, as `subjects`; the line's own fields come first."""

    def __init__(self, **always: str) -> None:
        """Set up with `always`: the subjects of every line of this process."""
        super().__init__()
        self._always = always

    def filter(self, record: logging.LogRecord) -> bool:
        record.subjects = {**self._always, **subjects()}
        return True
