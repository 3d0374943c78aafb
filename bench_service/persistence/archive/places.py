"""Files of an archive through pyarrow's filesystems: a folder, or a store of objects with the interface of S3.

A file appears whole or not at all: in a folder it is written next to its place, synced and renamed; a store of
objects shows an object only once it is whole. Credentials of a store come from the environment, as AWS names them.
"""

import os
from collections.abc import Generator
from contextlib import contextmanager
from functools import cache
from pathlib import Path, PurePosixPath
from typing import Any

from bench_service.model.errors import ArchiveAway


class Place:
    """The files under one address, `file:///folder` or `s3://bucket/prefix?endpoint_override=host:port&scheme=http`."""

    def __init__(self, address: str) -> None:
        """Open an address. Raises `ArchiveAway` for one that no filesystem has."""
        self.address = address
        with _away(address):
            self._files, self._root = _opened(address)

    @property
    def _local(self) -> bool:
        return self._files.type_name == "local"

    def read(self, name: str) -> bytes:
        """Return the content of a file. Raises `ArchiveAway`, also where there is no such file."""
        with _away(f"{self.address}: {name}"), self._files.open_input_stream(self._path(name)) as stream:
            return stream.read()

    def write(self, name: str, content: bytes) -> None:
        """Write a file whole; one of that name is replaced. Raises `ArchiveAway`."""
        with _away(f"{self.address}: {name}"):
            if self._local:
                _write_durably(Path(self._path(name)), content)
                return
            with self._files.open_output_stream(self._path(name)) as stream:
                stream.write(content)

    def names(self, folder: str) -> list[str]:
        """Return the names of the files directly in a folder, in order; none without such a folder. Raises
        `ArchiveAway`.
        """
        from pyarrow.fs import FileSelector, FileType

        with _away(f"{self.address}: {folder}"):
            found = self._files.get_file_info(FileSelector(self._path(folder), allow_not_found=True))
            return sorted(info.base_name for info in found if info.type == FileType.File)

    def remove(self, name: str) -> None:
        """Remove a file. Raises `ArchiveAway`, also where there is no such file."""
        with _away(f"{self.address}: {name}"):
            self._files.delete_file(self._path(name))

    def _path(self, name: str) -> str:
        return str(PurePosixPath(self._root) / name)


@cache
def place_at(address: str) -> Place:
    """Return the place at an address; it is opened once in a process. Raises `ArchiveAway`."""
    return Place(address)


def _opened(address: str) -> tuple[Any, str]:
    """The file system of an address, and the path in it."""
    from pyarrow.fs import FileSystem

    return FileSystem.from_uri(address if "://" in address else Path(address).absolute().as_uri())


@contextmanager
def _away(what: str) -> Generator[None]:
    import pyarrow as pa

    try:
        yield
    except (OSError, pa.ArrowException, ValueError) as error:
        raise ArchiveAway(f"the archive cannot be used ({what}): {' '.join(str(error).split())}") from error


def _write_durably(path: Path, content: bytes) -> None:
    path.parent.mkdir(parents=True, exist_ok=True)
    partial = path.with_name(f".{path.name}.{os.getpid()}.partial")
    try:
        with partial.open("wb") as file:
            file.write(content)
            file.flush()
            os.fsync(file.fileno())
        partial.replace(path)
    finally:
        partial.unlink(missing_ok=True)
    for parent in (path.parent, path.parent.parent):  # the second has the name of a folder that was just made
        folder = os.open(parent, os.O_RDONLY)
        try:
            os.fsync(folder)
        finally:
            os.close(folder)
