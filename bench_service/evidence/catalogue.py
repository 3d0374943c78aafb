"""The catalogue of procedures and methods, read when it is first wanted: that imports all of the numerics."""

from collections.abc import Mapping
from functools import cached_property

from bench_service.model.errors import NotFound
from bench_service.model.records import StoredResult
from procedures import catalog, methods
from procedures.core.report import Report
from procedures.procedure import Method, Outcome, Parameters, Procedure

AnyProcedure = Procedure[Parameters, Outcome]
AnyMethod = Method[Parameters, Outcome]


class Catalogue:
    """Procedures and methods by name."""

    @cached_property
    def procedures(self) -> Mapping[str, AnyProcedure]:
        """Every procedure by name."""
        return catalog.discover()

    @cached_property
    def methods(self) -> Mapping[str, AnyMethod]:
        """Every method by name."""
        return methods.discover()

    def procedure(self, name: str) -> AnyProcedure:
        """Return a procedure. Raises `NotFound`."""
        if name not in self.procedures:
            raise NotFound("procedure", name)
        return self.procedures[name]

    def method(self, name: str) -> AnyMethod:
        """Return a method. Raises `NotFound`."""
        if name not in self.methods:
            raise NotFound("method", name)
        return self.methods[name]

    def report(self, result: StoredResult) -> Report:
        """Lay out a stored result for a person: tables and figures."""
        entry = (self.procedures if result.kind == "procedure" else self.methods).get(result.name)
        if entry is None:
            return Report(f"{result.name} is no longer in the catalogue; the document below is as it was stored.")
        return entry.report(entry.result.model_validate(result.document))
