"""Catalogue of methods, one file each. A file put in this folder is found, listed with its schema, and tested."""

from typing import Any

from procedures.discovery import Discovered, discovered
from procedures.procedure import Method


def find(only: str | None = None) -> Discovered[Method[Any, Any]]:
    """Return every METHOD of this folder by name, or the one named `only`, and the files that give none, with the
    reason.
    """
    return discovered(__name__, __path__, "METHOD", Method, only)


def discover() -> dict[str, Method[Any, Any]]:
    """Return all methods of this folder by name, which is the file's. Raises the error of the first broken file."""
    return find().complete()
