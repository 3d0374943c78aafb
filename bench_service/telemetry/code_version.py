"""Identity of the code that made a number: the version, and a digest of the sources that are running."""

import hashlib
from importlib.metadata import version
from pathlib import Path

PACKAGES = ("bench_service", "procedures", "simulators")


def code_version() -> str:
    """Return the running code's version, as ``0.1.0+3f9a0c1b2d4e``: 12 digits of SHA-256 over all Python sources, by
    path.
    """
    root = Path(__file__).resolve().parents[2]
    digest = hashlib.sha256()
    for package in PACKAGES:
        for source in sorted((root / package).rglob("*.py")):
            digest.update(source.relative_to(root).as_posix().encode())
            digest.update(source.read_bytes())
    return f"{version('bench-service')}+{digest.hexdigest()[:12]}"
