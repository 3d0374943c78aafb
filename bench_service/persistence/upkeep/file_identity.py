"""Identity of an SQLite file: whether the file at its place is still the one that this process has open.

A deleted or replaced file stays open and takes every write; after a restart nothing of that is there. So each
transaction looks first, and looks again after its commit, before anything is acknowledged.
"""

import os
from pathlib import Path


class FileIdentity:
    """The file that was at a place when the database was opened, by device and inode."""

    def __init__(self, path: Path) -> None:
        """Remember the file that is there now. Raises `OSError` where there is none."""
        self._path = os.fspath(path.absolute())
        self._opened = _identity(self._path)
        self._log_lost = False

    def look_after_commit(self) -> None:
        """Look for the log that a commit has written to: while a connection is open SQLite itself never deletes it."""
        if not self._log_lost and not os.path.exists(f"{self._path}-wal"):
            self._log_lost = True

    def trouble(self) -> str | None:
        """Return why the file is no longer the opened one, and what helps; None where it is."""
        try:
            if _identity(self._path) == self._opened:
                return self._without_log() if self._log_lost else None
            what = "was replaced by another file"
        except FileNotFoundError:
            what = "was deleted or moved"
        except OSError as error:
            what = f"cannot be reached ({error.strerror})"
        return (
            f"the database file {self._path} {what} while the service runs: nothing is read or stored until the file "
            "that was opened is back in its place, or the service is restarted with the file that is to count"
        )

    def replaced(self) -> bool:
        """Return whether another file is at the place now."""
        try:
            return _identity(self._path) != self._opened
        except OSError:
            return False

    def _without_log(self) -> str:
        return (
            f"the log of the database, {self._path}-wal, was deleted while the service runs: what was stored last may "
            "be lost; restart the service, and look at what was acknowledged since"
        )


def _identity(path: str) -> tuple[int, int]:
    found = os.stat(path)
    return found.st_dev, found.st_ino
