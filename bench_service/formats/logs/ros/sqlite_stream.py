"""SQLite over a stream: a read-only file system for apsw, so that a file without a name can be a database."""

import itertools
from typing import Any, BinaryIO

from bench_service.formats.errors import UnreadableFile
from bench_service.formats.logs.bytes_at import size_of
from bench_service.formats.logs.optional import needed

CACHE_KIB = 8192
_NUMBERS = itertools.count()


def connected(stream: BinaryIO, name: str) -> tuple[Any, Any]:
    """Open a database that is in a stream, read-only; return it and its file system, which must live as long.

    Raises `UnreadableFile`.
    """
    apsw = needed("apsw", name)
    label = f"stream-{next(_NUMBERS)}"
    system = _file_system(apsw, stream, label)
    try:
        database = apsw.Connection(
            "file:log?immutable=1", flags=apsw.SQLITE_OPEN_READONLY | apsw.SQLITE_OPEN_URI, vfs=label
        )
        database.execute(f"PRAGMA cache_size = -{CACHE_KIB}")
        database.execute("PRAGMA mmap_size = 0")
        database.execute("SELECT count(*) FROM sqlite_master").fetchall()
    except apsw.Error as error:
        raise UnreadableFile(name, f"cannot be read as an SQLite database ({str(error)[:120]})") from error
    return database, system


def _file_system(apsw: Any, stream: BinaryIO, label: str) -> Any:
    """Make a file system with one file: the stream. Its classes need apsw, which is optional."""
    size = size_of(stream)

    class Held(apsw.VFSFile):
        """The stream as the database's only file."""

        def __init__(self, _name: Any, flags: list[int]) -> None:
            flags[1] = apsw.SQLITE_OPEN_READONLY | apsw.SQLITE_OPEN_MAIN_DB

        def xRead(self, amount: int, offset: int) -> bytes:  # noqa: N802  SQLite's name
            stream.seek(offset)
            return stream.read(amount)

        def xFileSize(self) -> int:  # noqa: N802
            return size

        def xLock(self, level: int) -> None:  # noqa: N802
            """Lock nothing: nobody else has the file."""

        def xUnlock(self, level: int) -> None:  # noqa: N802
            """Unlock nothing."""

        def xCheckReservedLock(self) -> bool:  # noqa: N802
            return False

        def xFileControl(self, op: int, ptr: int) -> bool:  # noqa: N802
            return False

        def xSectorSize(self) -> int:  # noqa: N802
            return 4096

        def xDeviceCharacteristics(self) -> int:  # noqa: N802
            return apsw.SQLITE_IOCAP_IMMUTABLE

        def xClose(self) -> None:  # noqa: N802
            """Leave the stream open: it is not ours."""

    class Streams(apsw.VFS):
        """A file system with one file."""

        def __init__(self, label: str) -> None:
            super().__init__(label, "")

        def xOpen(self, _name: Any, flags: list[int]) -> Any:  # noqa: N802
            return Held(_name, flags)

        def xFullPathname(self, path: str) -> str:  # noqa: N802
            return path

        def xAccess(self, path: str, flags: int) -> bool:  # noqa: N802
            return False

    return Streams(label)
