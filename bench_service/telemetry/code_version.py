"""Identity of the code that made a number: the version, and a digest of the sources that are running."""

import hashlib
import os
from collections.abc import Iterator
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
        for parts in sorted(_sources(root, package)):
            digest.update("/".join(parts).encode())
            with root.joinpath(*parts).open("rb", buffering=0) as source:
                digest.update(source.readall())
    return f"{version('bench-service')}+{digest.hexdigest()[:12]}"


def _sources(root: Path, package: str) -> Iterator[list[str]]:
    """Yield the path of each source of a package below `root`, in its parts."""
    for folder, _, names in os.walk(root / package):
        parts = os.path.relpath(folder, root).split(os.sep)
        yield from ([*parts, name] for name in names if name.endswith(".py"))
