"""Say in one line what this machine lacks before anything is installed. Runs on any Python 3."""

import sys

WANTED = (3, 11)


def missing():
    """The first thing that is missing, in words, or None."""
    if sys.version_info < WANTED:
        found = ".".join(map(str, sys.version_info[:3]))
        return "Python 3.11 or newer is needed, this is %s; name another with `make run PYTHON=python3.12`" % found
    try:
        import ensurepip  # noqa: F401
        import venv  # noqa: F401
    except ImportError:
        return "Python's venv module is missing; on Debian: apt-get install python3-venv"
    if sys.maxsize < 2**32:
        return "a 64-bit Python is needed: MuJoCo and PyArrow have no 32-bit builds"
    return None


if __name__ == "__main__":
    problem = missing()
    if problem:
        sys.exit("bench: " + problem)
