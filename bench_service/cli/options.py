"""Options and output functions that several commands share."""

import json
from contextlib import suppress
from math import isfinite
from typing import Annotated, Any

import typer
from rich.console import Console

from bench_service.cli.refusal import Refused

console = Console(markup=False, emoji=False)
errors = Console(stderr=True, markup=False, emoji=False)
"""Texts come from people and from the service, with brackets and colons that are no markup: colours are styles."""

Server = Annotated[str | None, typer.Option(help="Address of a service; without it, work in this process")]
AsJson = Annotated[bool, typer.Option("--json", help="Print JSON instead of tables")]


def parameter(text: str) -> tuple[str, Any]:
    """``name=value`` with the value as JSON, or as plain text where it is none."""
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
    """A console for tables: wide enough for their columns where the terminal is narrow, or none."""
    return Console(width=max(console.width, 140), markup=False, emoji=False)


def wide_errors() -> Console:
    """A console on standard error for tables, as wide as they need."""
    return Console(stderr=True, width=max(errors.width, 160), markup=False, emoji=False)
