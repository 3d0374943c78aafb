"""Reading of TOML files of a laboratory into models: a refusal names the file, the line and the field."""

import tomllib
from collections.abc import Sequence
from pathlib import Path
from typing import Any, TypeVar

from pydantic import BaseModel, ValidationError

from bench_service.drivers.bench_file.lines import line_of
from bench_service.model.errors import Misconfigured

M = TypeVar("M", bound=BaseModel)
MOST_ERRORS = 5
"""Number of errors of a file that are named at most; more are counted."""
LARGEST = 1_000_000
"""Size of the largest file that is read [bytes]."""


def text_of(path: Path) -> str:
    """Return the content of a file as text. Raises `Misconfigured` naming the file where it cannot be read, is too
    large or not UTF-8.
    """
    try:
        if path.stat().st_size > LARGEST:
            raise Misconfigured(f"{path} is larger than {LARGEST} bytes, the most that a bench file may have")
        return path.read_text(encoding="utf-8")
    except OSError as error:
        raise Misconfigured(f"{path} cannot be read: {error.strerror}") from error
    except UnicodeDecodeError as error:
        raise Misconfigured(f"{path} is not UTF-8 text") from error


def document_of(path: Path, text: str) -> dict[str, Any]:
    """Return the tables of a TOML text. Raises `Misconfigured` with the line and column of what is not TOML."""
    try:
        return tomllib.loads(text)
    except tomllib.TOMLDecodeError as error:
        raise Misconfigured(f"{path}: {error}") from error


def validated(model: type[M], given: Any, path: Path, text: str, where: Sequence[str] = ()) -> M:
    """Return a table of a file as its model. `where`: path of the table. Raises `Misconfigured` with line, field and
    reason.
    """
    try:
        return model.model_validate(given)
    except ValidationError as error:
        found = error.errors(include_url=False)
    sentences = [_sentence(path, text, (*where, *one["loc"]), one) for one in found[:MOST_ERRORS]]
    more = f"; and {len(found) - MOST_ERRORS} more" if len(found) > MOST_ERRORS else ""
    raise Misconfigured("; ".join(sentences) + more)


def place(path: Path, text: str, where: Sequence[object]) -> str:
    """Return the file and the line of a field, as text for a message."""
    line = line_of(text, where)
    return f"{path}" if line is None else f"{path}, line {line}"


def _sentence(path: Path, text: str, where: tuple[object, ...], error: Any) -> str:
    field = ".".join(map(str, where)) or "the file"
    at = place(path, text, where)
    if error["type"] == "missing":
        return f"{at}: {field} is missing"
    if error["type"] == "extra_forbidden":
        return f"{at}: {field} is no field"
    reason = error["msg"].removeprefix("Value error, ").removeprefix("Assertion failed, ")
    given = error["input"]
    shown = "" if isinstance(given, dict | list) else f" = {given!r}"
    return f"{at}: {field}{shown}: {reason}"
