"""Options and output functions that several commands share."""

import json
from contextlib import suppress
from math import isfinite
from pathlib import Path
from typing import Annotated, Any

import typer
from pydantic import ValidationError
from rich.console import Console

from bench_service.cli.refusal import Refused
from bench_service.settings import Settings
from bench_service.wall_clock import new_id

console = Console(markup=False, emoji=False)
errors = Console(stderr=True, markup=False, emoji=False)
"""Texts come from people and from the service, with brackets and colons that are no markup: colours are styles."""

Server = Annotated[str | None, typer.Option(help="Address of a service; without it, work in this process")]
BenchFile = Annotated[
    Path | None,
    typer.Option("--bench-file", dir_okay=False, help="Bench file of the bench; default: the one in the settings"),
]
AsJson = Annotated[bool, typer.Option("--json", help="Print JSON instead of tables")]
Limit = Annotated[int, typer.Option(min=1, help="How many")]
By = Annotated[str | None, typer.Option(help="Your name, for the job and the audit trail")]
Set = Annotated[list[str], typer.Option("--set", help="A parameter, name=JSON value; may be repeated")]
Label = Annotated[list[str], typer.Option(help="name=text; may be repeated")]
Key = Annotated[str | None, typer.Option(help="Idempotency key: repeated with it, the same job is waited for")]
NO_ITEMS: list[str] = []


def parameter(text: str) -> tuple[str, Any]:
    """Return name and value of ``name=value``, the value as JSON, or as plain text where it is none. Raises
    `Refused`.
    """
    name, separator, value = text.partition("=")
    if not separator or not name:
        raise Refused(f"--set {text}: expected name=value")

    def finite(number: str) -> float:
        if isfinite(found := float(number)):
            return found
        raise Refused(f"--set {name}: {number} is not a finite number")

    try:
        return name, json.loads(value, parse_float=finite, parse_constant=finite)
    except json.JSONDecodeError:
        return name, value
    except ValueError as error:  # more digits than Python reads
        raise Refused(f"--set {name}: {error}") from error


def notice(text: str) -> None:
    """Print a notice that is no failure on standard error, above a progress bar where there is one."""
    errors.print(text, style="yellow", soft_wrap=True)


def announce(text: str) -> None:
    """Print a line of a service's progress. A full disk or a closed output does not stop the service."""
    with suppress(OSError):
        print(text, flush=True)


def wide() -> Console:
    """Return a console for tables: wide enough for their columns where the terminal is narrow, or none."""
    return Console(width=max(console.width, 140), markup=False, emoji=False)


def wide_errors() -> Console:
    """Return a console on standard error for tables, as wide as they need."""
    return Console(stderr=True, width=max(errors.width, 160), markup=False, emoji=False)


def labels(texts: list[str]) -> dict[str, str]:
    """Return ``name=text`` texts as labels by name. Raises `Refused`."""
    pairs = [text.partition("=") for text in texts]
    for name, equals, value in pairs:
        if not (name and equals and value):
            raise Refused(f"--label {name}{equals}{value}: expected name=text")
    return {name: value for name, _, value in pairs}


def key_or_new(key: str | None) -> str:
    """Return the idempotency key of a create, a new one where none is given, so that the request can be repeated.
    Raises `Refused`.
    """
    if key is None:
        return new_id()
    if not (key.isascii() and key.isprintable() and key):
        raise Refused(f"--key {key!r}: only printable ASCII characters are allowed")
    return key


def named(by: str | None) -> dict[str, str]:
    """Return the header by which a person is known to the service. Raises `Refused`."""
    if by is None:
        return {}
    if not (by.isprintable() and by.strip()):
        raise Refused(f"--by {by!r}: a name without line breaks is needed")
    try:
        by.encode("latin-1")
    except UnicodeEncodeError as error:
        raise Refused(f"--by {by!r}: only Latin letters are allowed") from error
    return {"X-Requested-By": by}


def of_bench(settings: Settings, bench: str | None, bench_file: Path | None = None) -> Settings:
    """Return the settings of another bench, or of the bench of a file.

    Raises `Refused` for a name that no bench can have.
    """
    given = settings.model_dump()
    if bench_file is not None:
        given = {name: value for name, value in given.items() if name != "bench_id"} | {"bench_file": bench_file}
    if bench is not None:
        given["bench_id"] = bench
    try:
        return Settings.model_validate(given)
    except ValidationError as error:
        raise Refused(f"--bench {bench}: {error.errors()[0]['msg']}") from error
