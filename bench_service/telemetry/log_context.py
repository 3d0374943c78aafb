"""What a line of the log is about: bench, job, step, request. Set where it is known, read by whoever writes lines."""

import logging
from collections.abc import Generator
from contextlib import contextmanager
from contextvars import ContextVar

_ABOUT: ContextVar[dict[str, str] | None] = ContextVar("about", default=None)


@contextmanager
def about(**subjects: str | None) -> Generator[None]:
    """Lines written inside are about these: `bench`, `job` and its `step`, `campaign` and `campaign_step`, `request`.

    None adds nothing.
    """
    known = {name: value for name, value in subjects.items() if value is not None}
    token = _ABOUT.set({**(_ABOUT.get() or {}), **known})
    try:
        yield
    finally:
        _ABOUT.reset(token)


def subjects() -> dict[str, str]:
    """What lines are about here and now."""
    return dict(_ABOUT.get() or {})


def request_id() -> str:
    """The request that is being answered, or nothing."""
    return (_ABOUT.get() or {}).get("request", "")


class AddSubjects(logging.Filter):
    """Puts what a line is about into its record, as `subjects`; what the line says itself comes first."""

    def __init__(self, **always: str) -> None:
        """`always`: what every line of this process is about."""
        super().__init__()
        self._always = always

    def filter(self, record: logging.LogRecord) -> bool:
        record.subjects = {**self._always, **subjects()}
        return True
