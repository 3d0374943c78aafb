"""Lines of the command `bench` as documents show them, held against the names and options that the program has."""

from functools import cache
from typing import Any

import typer

from bench_service.cli.commands import app


@cache
def _program() -> Any:
    return typer.main.get_command(app)


def refused(words: list[str]) -> str:
    """The reason why `bench` would not take these words, or "". Nothing is run, and no value is looked at."""
    command = _program()
    while hasattr(command, "commands"):
        if not words or words[0] == "--help":
            return ""
        if words[0] not in command.commands:
            return f"no command {words[0]!r}"
        command, words = command.commands[words[0]], words[1:]
    options = {o: p for p in command.params for o in (*p.opts, *p.secondary_opts) if o.startswith("-")}
    arguments = [p for p in command.params if not p.opts[0].startswith("-")]
    given, place = 0, 0
    while place < len(words):
        name, has_value, _ = words[place].partition("=")
        if name == "--help":
            return ""
        if not name.startswith("--") and name != "-o":
            given += 1
        elif name not in options:
            return f"no option {name!r}"
        elif not has_value and not getattr(options[name], "is_flag", False):
            place += 1
        place += 1
    least = sum(p.required for p in arguments)
    return "" if least <= given and (given <= len(arguments) or any(p.nargs == -1 for p in arguments)) else "arguments"


def unknown(text: str) -> str:
    """The reason why a command that a sentence quotes, such as `bench job show|wait ID [--json]`, is none, or "".

    Alternatives stand between bars, options in brackets; capitals and … stand for values. Arguments are not counted.
    """
    commands = [_program()]
    for word in (one.strip("[],()") for one in text.split()[1:]):
        if word.startswith("-"):
            name = word.partition("=")[0]
            if name not in ("--help", "-") and not all(name in _options(command) for command in commands):
                return f"no option {name!r}"
        elif any(hasattr(command, "commands") for command in commands) and word[:1].islower():
            names = word.split("|")
            missing = [name for name in names if not any(name in command.commands for command in commands)]
            if missing:
                return f"no command {missing[0]!r}"
            commands = [command.commands[name] for command in commands for name in names]
    return ""


def _options(command: Any) -> set[str]:
    """Options of a command; of a group, those of all commands below it."""
    below = getattr(command, "commands", {}).values()
    return {o for p in command.params for o in (*p.opts, *p.secondary_opts)} | {o for c in below for o in _options(c)}
