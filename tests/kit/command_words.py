"""Lines of the command `bench` as documents show them, held against the names and options that the program has."""

from typing import Any

import typer

from bench_service.cli.commands import app


def refused(words: list[str]) -> str:
    """The reason why `bench` would not take these words, or "". Nothing is run, and no value is looked at."""
    command: Any = typer.main.get_command(app)
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
