"""Files of the service are for its own user alone: the database, the devices' state and journals, the logs.

What a command writes where a person names a place, an export or a report, has the rights that this person's files have.
"""

import os
import stat
from pathlib import Path

from bench_service.settings import Settings

OTHERS = 0o077
"""Rights of the group and of everybody else."""
_given: list[int] = []
"""The umask that this process was started with, once `protect` has replaced it."""


def protect(settings: Settings) -> None:
    """Make files for this user alone from now on, and take the permissions of others away from the service's files that
    exist.

    A folder is closed to others where it holds nothing but the service's files: a home folder that a person put the
    database into stays open. What belongs to another user stays as it is.
    """
    before = os.umask(OTHERS)
    if not _given:
        _given.append(before)
    database = _database_file(settings)
    for folder in {settings.devices_in(), *([] if database is None else [database.parent])}:
        _close(folder, None if database is None else database.name)


def mode_of_exports() -> int:
    """Return the mode bits of a file that a person requested."""
    if not _given:
        os.umask(umask := os.umask(OTHERS))
        return 0o666 & ~umask
    return 0o666 & ~_given[0]


def _close(folder: Path, database: str | None) -> None:
    try:
        names = os.listdir(folder)
    except OSError:  # not there yet: what makes it makes it for this user alone
        return
    own = [name for name in names if name.startswith("bench-") or (database is not None and name.startswith(database))]
    paths = [folder / name for name in own]
    for path in [*paths, *([folder] if names and len(own) == len(names) else [])]:
        _take_away(path)


def _take_away(path: Path) -> None:
    try:
        found = path.lstat()
        if found.st_uid == os.geteuid() and found.st_mode & OTHERS and not stat.S_ISLNK(found.st_mode):
            path.chmod(stat.S_IMODE(found.st_mode) & ~OTHERS)
    except OSError:  # it went this moment, or the file system knows no rights
        return


def _database_file(settings: Settings) -> Path | None:
    """Return the file of an SQLite database; None for Postgres."""
    scheme, _, rest = settings.database_url.partition(":///")
    file = rest.partition("?")[0]
    return Path(file) if scheme.startswith("sqlite") and file else None
