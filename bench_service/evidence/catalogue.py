"""The catalogue of procedures and methods. A file is imported when its entry is asked for, all of them for a list.

All of them import the whole of the numerics, which takes most of a second; a single one has what it needs alone.
"""

import logging
from collections.abc import Mapping
from functools import cached_property
from threading import Thread
from typing import Any, TypeVar

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
    """Procedures and methods by name, imported from their folders. A file that cannot be read is left out, and named in
    the log and in `notes`.
    """

    def __init__(self) -> None:
        self._left_out: dict[tuple[str, str], str] = {}
        self._alone: dict[tuple[str, str], Any] = {}
        """Entries that were read by their names, before or apart from all the others."""
        self._reading: Thread | None = None

    @cached_property
    def procedures(self) -> Mapping[str, AnyProcedure]:
        """All procedures by name; their files are imported at the first use."""
        return self._read("procedure", catalog.find())

    @cached_property
    def methods(self) -> Mapping[str, AnyMethod]:
        """All methods by name; their files are imported at the first use."""
        return self._read("method", methods.find())

    def procedure(self, name: str) -> AnyProcedure:
        """Return a procedure by name. Raises `NotFound`, with the reason where its file is broken."""
        return self._required("procedure", name)

    def method(self, name: str) -> AnyMethod:
        """Return a method by name. Raises `NotFound`, with the reason where its file is broken."""
        return self._required("method", name)

    def titles(self) -> Mapping[str, str]:
        """Title of each procedure and method by its name, of those that have been read.

        Reading them all takes a second or two: the first call begins it in a thread and waits for nothing.
        """
        if "procedures" in self.__dict__ and "methods" in self.__dict__:
            return self._titles
        if self._reading is None:
            self._reading = Thread(target=lambda: self._titles, name="titles", daemon=True)
            self._reading.start()
        return {name: entry.title for (_, name), entry in list(self._alone.items())}

    @cached_property
    def _titles(self) -> Mapping[str, str]:
        return {name: entry.title for name, entry in (*self.methods.items(), *self.procedures.items())}

    def notes(self) -> tuple[str, ...]:
        """Return a sentence for each file that was left out so far."""
        return tuple(self._left_out.values())

    def report(self, result: StoredResult) -> Report:
        """Return a stored result laid out for a person: tables and figures. Where its procedure is gone or cannot make
        the report, a report that says so.
        """
        try:
            entry = self._required(result.kind, result.name)
        except NotFound:
            return Report(f"{result.name} is no longer in the catalogue; the document below is as it was stored.")
        try:
            return entry.report(entry.result.model_validate(result.document))
        except Exception as error:  # of the entry's author, or a document of an earlier version: the numbers are there
            sentence = f"{result.name} made no report of this result: {described(error)}"
            log.exception("result %s: %s", result.id, sentence)
            return Report(f"{sentence}; the document below is as it was stored.")

    def _required(self, kind: str, name: str) -> Any:
        """Return the entry of a name, from its own file alone. Raises `NotFound`."""
        if (kind, name) not in self._alone and (kind, name) not in self._left_out:
            found_alone: Discovered[Any] = catalog.find(name) if kind == "procedure" else methods.find(name)
            for found, entry in self._read(kind, found_alone).items():
                self._alone[kind, found] = entry
        if (kind, name) not in self._alone:
            raise NotFound(kind, name, self._left_out.get((kind, name), ""))
        return self._alone[kind, name]

    def _read(self, kind: str, found: Discovered[E]) -> Mapping[str, E]:
        folder = "procedures/catalog" if kind == "procedure" else "procedures/methods"
        for name, error in found.broken.items():
            if (kind, name) in self._left_out:
                continue
            sentence = f"{folder}/{name}.py is left out: {described(error)}"
            self._left_out[kind, name] = sentence
            log.error("%s", sentence)
            log.debug("traceback of %s/%s.py", folder, name, exc_info=error)
        return found.entries
