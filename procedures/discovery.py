"""Import of a catalogue folder, one entry a file; a broken file is named, and the others are kept."""

from collections.abc import Sequence
from dataclasses import dataclass, field
from importlib import import_module
from pkgutil import iter_modules
from typing import Generic, TypeVar

from procedures.importing import IMPORTING

E = TypeVar("E")


@dataclass
class Discovered(Generic[E]):
    """Entries found in a folder by name, and the error of each file that gives none."""

    entries: dict[str, E] = field(default_factory=dict[str, E])
    broken: dict[str, Exception] = field(default_factory=dict[str, Exception])

    def complete(self) -> dict[str, E]:
        """Return all entries of the folder by name. Raises the error of the first file that is broken."""
        for error in self.broken.values():
            raise error
        return self.entries


def discovered(
    package: str, path: Sequence[str], attribute: str, kind: type[E], only: str | None = None
) -> Discovered[E]:
    """Import every module of a package for the entry that it holds under `attribute`, an instance of `kind`.

    `only`: the name of the one module to import; None: all of them. Where there is no such module nothing is found.

    A file is broken where its import fails or would end the program, where it holds no such entry, or where that has
    another name than the file.
    """
    found: Discovered[E] = Discovered()
    for module in iter_modules(path):
        if only is not None and module.name != only:
            continue
        place = f"{package}.{module.name}"
        try:
            with IMPORTING:
                entry = getattr(import_module(place), attribute, None)
            if not isinstance(entry, kind):
                raise TypeError(f"{place}: there is no {attribute}, which must be a {kind.__name__}")
            name = getattr(entry, "name", None)
            if name != module.name:
                raise ValueError(f"{place}: {attribute}.name is {name!r}, not the file's name")
        except SystemExit as error:  # of a script: the service must outlive it
            ended = ImportError(f"{place}: importing it ends the program with {error!r}")
            found.broken[module.name] = ended.with_traceback(error.__traceback__)
        except Exception as error:  # whatever one file does, the others can be used
            found.broken[module.name] = error
        else:
            found.entries[module.name] = entry
    return found
