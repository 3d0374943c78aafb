"""Describes an unexpected error in a sentence that names the file and the line to look at."""

import logging
import sys
import traceback
from collections.abc import Generator
from contextlib import contextmanager
from pathlib import Path

from pydantic import ValidationError

from bench_service.model.errors import ServiceError
from procedures.bench.errors import BenchError
from procedures.core.errors import DomainError, ProcedureDefect

log = logging.getLogger(__name__)

PACKAGES = ("procedures", "simulators", "bench_service")
CATALOGUES = ("procedures/catalog/", "procedures/methods/")
"""Folders in which a procedure's author works."""
ROOT = Path(__file__).resolve().parents[2]


def described(error: BaseException) -> str:
    """Kind, message and place of an error: `ValueError: boom (procedures/catalog/static_run.py, line 12, in analyse)`.

    The place is the innermost one in a catalogue file, where an author looks first, and the one in this project's
    other code that raised; for a syntax error, the error's own.
    """
    kind = f"{type(error).__name__}: {error.msg if isinstance(error, SyntaxError) else error}".strip(": ")
    places = _places(error)
    return f"{kind} ({'; raised in '.join(places)})" if places else kind


@contextmanager
def author_is_named(procedure: str, function: str) -> Generator[None]:
    """Call a function of a procedure in this block: an error that its author did not foresee becomes a
    `ProcedureDefect` that names file and line, and the log has the stack. Known errors pass as they are.
    """
    try:
        yield
    except (DomainError, BenchError, ServiceError, ValidationError):
        raise
    except (Exception, SystemExit) as error:
        sentence = f"`{function}` of procedure {procedure} failed: {described(error)}"
        log.exception("%s", sentence)
        raise ProcedureDefect(sentence) from error


def _places(error: BaseException) -> list[str]:
    if isinstance(error, SyntaxError) and error.filename:
        return [f"{_shown(error.filename)}, line {error.lineno}"]
    frames = [(_shown(frame.filename), frame) for frame in traceback.extract_tb(error.__traceback__)]
    ours = [one for one in frames if one[0].split("/")[0] in PACKAGES] or frames
    of_author = [one for one in ours if one[0].startswith(CATALOGUES)]
    chosen = [*of_author[-1:], *ours[-1:]]
    return list(dict.fromkeys(f"{file}, line {frame.lineno}, in {frame.name}" for file, frame in chosen))


def _shown(file: str) -> str:
    """The file's path from the project's root, or from the folder that Python imports from."""
    path = Path(file)
    for folder in (ROOT, *map(Path, sys.path)):
        if folder.is_absolute() and path.is_relative_to(folder):
            return path.relative_to(folder).as_posix()
    return path.as_posix()
