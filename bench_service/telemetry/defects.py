"""Describes an unexpected error in a sentence that names the file and the line to look at."""

import sys
import traceback
from pathlib import Path

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
