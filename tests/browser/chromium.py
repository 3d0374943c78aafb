"""Find a Chromium for the browser tests; as a command, install the one of Debian where there is none."""

import os
import shutil
import subprocess
import sys

LEFT_OUT = 3
"""Exit code where the browser tests cannot be run."""
NAMES = ("chromium", "chromium-browser", "google-chrome", "google-chrome-stable")


def found() -> str | None:
    """Path of a Chromium on this machine; `CHROMIUM` names another one."""
    given = os.environ.get("CHROMIUM")
    return given or next((path for name in NAMES if (path := shutil.which(name))), None)


def missing() -> str | None:
    """Sentence on the part that the browser tests lack on this machine; None: they have all."""
    try:
        import playwright  # noqa: F401
    except ImportError:
        return "playwright is not installed"
    return None if found() else "there is no Chromium"


def main() -> None:
    """Install Debian's Chromium where none is found and this user may do it."""
    apt = shutil.which("apt-get")
    if found() is None and apt is not None and os.geteuid() == 0:
        for arguments in (["update", "-qq"], ["install", "-y", "-qq", "--no-install-recommends", "chromium"]):
            subprocess.run([apt, *arguments], check=False, stdout=subprocess.DEVNULL)
    if found() is None:
        print("left out: the pages in a real Chromium: there is none, and this user cannot install it")
        sys.exit(LEFT_OUT)


if __name__ == "__main__":
    main()
