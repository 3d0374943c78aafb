"""ONE FILE = ONE METHOD. A file put here is found, listed by the service with its schema, and tested for form."""

from importlib import import_module
from pkgutil import iter_modules
from typing import Any

from procedures.procedure import Method


def discover() -> dict[str, Method[Any, Any]]:
    """Every METHOD of this folder by name. The name is the file's; a mismatch is a programming error."""
    found: dict[str, Method[Any, Any]] = {}
    for module in iter_modules(__path__):
        entry: Method[Any, Any] = import_module(f"{__name__}.{module.name}").METHOD
        if entry.name != module.name:
            raise ValueError(f"{__name__}.{module.name}: METHOD.name is {entry.name!r}, not the file's name")
        found[entry.name] = entry
    return found
