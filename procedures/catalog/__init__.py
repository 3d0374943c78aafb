"""Catalogue of procedures, one file each. A file put in this folder is found, listed with its schema, and tested."""

from typing import Any

from procedures.discovery import Discovered, discovered
from procedures.procedure import Procedure


def find(only: str | None = None) -> Discovered[Procedure[Any, Any]]:
    """Return every PROCEDURE of this folder by name, or the one named `only`, and the files that give none, with the
    reason.
    """
    return discovered(__name__, __path__, "PROCEDURE", Procedure, only)


def discover() -> dict[str, Procedure[Any, Any]]:
    """Return all procedures of this folder by name, which is the file's. Raises the error of the first broken file."""
    return find().complete()
