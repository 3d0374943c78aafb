"""The catalogue of procedures and methods, read at its first use, because that imports all of the numerics."""

import logging
from collections.abc import Mapping
from functools import cached_property
from typing import TypeVar

from bench_service.model.errors import NotFound
from bench_service.model.records import StoredResult
from bench_service.telemetry.defects import described
from procedures import catalog, methods
from procedures.core.report import Report
from procedures.discovery import Discovered
from procedures.procedure import Method, Outcome, Parameters, Procedure

AnyProcedure = Procedure[Parameters, Outcome]
AnyMethod = Method[Parameters, Outcome]
E = TypeVar("E")
log = logging.getLogger(__name__)


class Catalogue:
    """Procedures and methods by name. A file that cannot be read is left out, and named in the log and in `notes`."""

    def __init__(self) -> None:
        self._left_out: dict[tuple[str, str], str] = {}

    @cached_property
    def procedures(self) -> Mapping[str, AnyProcedure]:
        """Every procedure by name, read when it is first wanted."""
        return self._read("procedure", "procedures/catalog", catalog.find())

    @cached_property
    def methods(self) -> Mapping[str, AnyMethod]:
        """Every method by name, read when it is first wanted."""
        return self._read("method", "procedures/methods", methods.find())

    def procedure(self, name: str) -> AnyProcedure:
        """Return a procedure by name. Raises `NotFound`, with the reason where its file is broken."""
        if name not in self.procedures:
            raise NotFound("procedure", name, self._left_out.get(("procedure", name), ""))
        return self.procedures[name]

    def method(self, name: str) -> AnyMethod:
        """Return a method by name. Raises `NotFound`, with the reason where its file is broken."""
        if name not in self.methods:
            raise NotFound("method", name, self._left_out.get(("method", name), ""))
        return self.methods[name]

    def notes(self) -> tuple[str, ...]:
        """A sentence for each file that was left out so far."""
        return tuple(self._left_out.values())

    def report(self, result: StoredResult) -> Report:
        """Lay out a stored result for a person: tables and figures."""
        entry = (self.procedures if result.kind == "procedure" else self.methods).get(result.name)
        if entry is None:
            return Report(f"{result.name} is no longer in the catalogue; the document below is as it was stored.")
        return entry.report(entry.result.model_validate(result.document))

    def _read(self, kind: str, folder: str, found: Discovered[E]) -> Mapping[str, E]:
        for name, error in found.broken.items():
            sentence = f"{folder}/{name}.py is left out: {described(error)}"
            self._left_out[kind, name] = sentence
            log.error("%s", sentence)
            log.debug("where %s/%s.py broke", folder, name, exc_info=error)
        return found.entries
