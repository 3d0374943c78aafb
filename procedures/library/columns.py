"""Columns of a text or numpy file: the one place of the package that reads a file, for use without the service."""

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import chain

import numpy as np

from procedures.core.arrays import Array
from procedures.core.errors import MissingChannel, UnfitRecording


@dataclass(frozen=True)
class Columns:
    """Named columns of equal length, as read from a file."""

    names: tuple[str, ...]
    values: Array
    """Shape (n, columns)."""

    def __getitem__(self, name: str) -> Array:
        """One column, (n,). Raises `MissingChannel`."""
        if name not in self.names:
            raise MissingChannel(name, self.names)
        return np.ascontiguousarray(self.values[:, self.names.index(name)])

    def __iter__(self) -> Iterator[str]:
        return iter(self.names)

    def __len__(self) -> int:
        return len(self.values)


def load(file: str, *, delimiter: str = ",", comment: str = "#") -> Columns:
    """Read the columns of a CSV file with or without a header, of a .npy array or of the arrays of a .npz file.

    An empty cell or one that is no number is refused; NaN written as such stays NaN. Larger logs, other
    formats and their descriptions are the service's: `bench import`. Raises `UnfitRecording`.
    """
    try:
        if str(file).endswith((".npy", ".npz")):
            return _numpy_file(str(file))
        return _text_file(str(file), delimiter, comment)
    except (OSError, ValueError, EOFError) as error:
        raise UnfitRecording(f"{file} cannot be read: {error}") from error


def _numpy_file(file: str) -> Columns:
    found = np.load(file, allow_pickle=False)
    if isinstance(found, np.ndarray):
        if found.ndim not in (1, 2):
            raise ValueError(f"an array of shape {found.shape} has no columns")
        values = np.asarray(found if found.ndim == 2 else found[:, None], dtype=np.float64)
        return Columns(tuple(f"column_{k}" for k in range(values.shape[1])), values)
    with found:
        arrays = {name: np.asarray(found[name], dtype=np.float64) for name in found.files}
    shapes = {name: array.shape for name, array in arrays.items()}
    if not arrays or any(len(shape) != 1 for shape in shapes.values()) or len(set(shapes.values())) != 1:
        raise ValueError(f"its arrays must be columns of one length; they are {shapes}")
    return Columns(tuple(arrays), np.column_stack(list(arrays.values())))


def _text_file(file: str, delimiter: str, comment: str) -> Columns:
    with open(file, encoding="utf-8-sig") as lines:
        kept = (line for line in lines if line.strip() and not line.lstrip().startswith(comment))
        first = next(kept, "")
        cells = [cell.strip() for cell in first.split(delimiter)]
        is_header = not all(_is_number(cell) for cell in cells)
        below = kept if is_header else chain([first], kept)
        head = next(below, None)
        if head is None:
            raise ValueError("it has no row of numbers")
        values = np.loadtxt(chain([head], below), dtype=np.float64, delimiter=delimiter, comments=comment, ndmin=2)
    if values.shape[1] != len(cells):
        raise ValueError(f"{len(cells)} names and {values.shape[1]} columns")
    names = tuple(cells) if is_header else tuple(f"column_{k}" for k in range(len(cells)))
    if len(set(names)) != len(names):
        raise ValueError(f"its header has a name twice: {', '.join(names)}")
    return Columns(names, values)


def _is_number(cell: str) -> bool:
    try:
        float(cell)
    except ValueError:
        return False
    return True
