"""``bench completion``: completion of commands, options and names of procedures in a shell."""

from enum import StrEnum
from typing import Annotated

import typer


class Shell(StrEnum):
    """Shells for which a completion script can be printed."""

    BASH = "bash"
    ZSH = "zsh"
    FISH = "fish"


def prepare() -> None:
    """Register the completion answers of all shells that the scripts ask this program for."""
    from typer._completion_classes import completion_init

    completion_init()


def completion(shell: Annotated[Shell, typer.Argument(help="Shell to write the completion for")]) -> None:
    """Print a script for completion: eval "$(bench completion bash)"."""
    from typer._completion_shared import get_completion_script

    print(get_completion_script(prog_name="bench", complete_var="_BENCH_COMPLETE", shell=shell.value))


def procedure_names(incomplete: str) -> list[str]:
    """Return the names of procedures that begin with the typed text; by their files, which is quick."""
    from procedures import catalog

    return _names(catalog.__path__[0], incomplete)


def method_names(incomplete: str) -> list[str]:
    """Return the names of methods that begin with the typed text; by their files, which is quick."""
    from procedures import methods

    return _names(methods.__path__[0], incomplete)


def _names(folder: str, incomplete: str) -> list[str]:
    from pkgutil import iter_modules

    return [module.name for module in iter_modules([folder]) if module.name.startswith(incomplete)]
