"""Say in one line what this machine lacks before anything is installed, or what it has. Runs on any Python 3."""

import sys

WANTED = (3, 11)
WANTED_SQLITE = (3, 35)


def found():
    """Versions of Python and of the SQLite library that it is linked to, in words."""
    try:
        from sqlite3 import sqlite_version
    except ImportError:
        sqlite_version = None
    python = "Python " + ".".join(map(str, sys.version_info[:3]))
    return python + (" with SQLite " + sqlite_version if sqlite_version else " without SQLite")


def missing():
    """The first thing that is missing, in words, or None."""
    if sys.version_info < WANTED:
        return "Python 3.11 or newer is needed, this is %s; name another with `make run PYTHON=python3.12`" % found()
    try:
        import ensurepip  # noqa: F401
        import venv  # noqa: F401
    except ImportError:
        return "Python's venv module is missing; on Debian: apt-get install python3-venv"
    try:
        import sqlite3
    except ImportError:
        return "Python's sqlite3 module is missing: this Python was built without SQLite's headers (libsqlite3-dev)"
    if sqlite3.sqlite_version_info < WANTED_SQLITE:
        return "SQLite 3.35 or newer is needed, this is %s; name another Python with `make run PYTHON=…`" % found()
    if sys.maxsize < 2**32:
        return "a 64-bit Python is needed: MuJoCo and PyArrow have no 32-bit builds"
    return None


if __name__ == "__main__":
    problem = missing()
    if problem:
        sys.exit("bench: " + problem)
    print("bench: " + found())
