"""Packages of the extra group `formats`, imported when a file needs them."""

import importlib
from typing import Any

from bench_service.formats.errors import UnreadableFile


def needed(module: str, file: str) -> Any:
    """Import and return a module of an optional package. Raises `UnreadableFile` with the way out where it is not
    installed.
    """
    try:
        return importlib.import_module(module)
    except ImportError as error:
        package = module.split(".")[0]
        raise UnreadableFile(
            file, f"needs the package {package} to be read: install the extra group, bench-service[formats] ({error})"
        ) from error
