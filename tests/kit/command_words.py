"""Lines of the command `bench` as documents show them, parsed as the program parses them."""

import click
import typer

from bench_service.cli.commands import app


def parsed(words: list[str]) -> None:
    """Parse a line of `bench` as the program does, and run nothing. Raises `click.UsageError`."""
    command: click.Command = typer.main.get_command(app)
    context = click.Context(command, info_name="bench")
    while isinstance(command, click.Group):
        if not words or words[0] == "--help":
            return
        found = command.get_command(context, words[0])
        if found is None:
            raise click.UsageError(f"no command {words[0]!r}")
        context, command, words = click.Context(found, parent=context, info_name=words[0]), found, words[1:]
    for parameter in command.params:
        if isinstance(parameter.type, click.Path):
            parameter.type.exists = False
    if "--help" not in words:
        command.make_context(context.info_name or "", words, parent=context.parent)
