"""Two revisions of the service to be measured in one run: this checkout, and an older one that is built beside it."""

import os
import subprocess
import sys
import tempfile
from collections.abc import Generator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

from tests.benchmarks.process import Service, command, free_port

HERE = Path(__file__).resolve().parents[2]
OURS = ("bench_service", "procedures", "simulators")
"""Packages that an editable install leaves to be compiled at the first import: compiled beforehand, in both."""


@dataclass(frozen=True)
class Revision:
    """A checkout with its own environment."""

    name: str
    folder: Path

    @property
    def python(self) -> Path:
        """The interpreter of its environment."""
        return self.folder / ".venv" / "bin" / "python"

    @property
    def commit(self) -> str:
        """Its commit, with a plus sign where its files differ from that."""
        return _said(["git", "-C", str(self.folder), "describe", "--always", "--dirty=+"])

    @contextmanager
    def service(
        self, prefix: tuple[str, ...] = (), whole: tuple[str, ...] = (), environment: dict[str, str] | None = None
    ) -> Generator[Service]:
        """Its service on an empty SQLite database; `prefix` comes before its command, as a profiler's does.

        `whole`: a command in place of its own; `environment`: variables in addition.
        """
        with tempfile.TemporaryDirectory(prefix="bench-") as folder:
            port = free_port()
            own = {"BENCH_DATABASE_URL": f"sqlite:///{folder}/bench.sqlite", "BENCH_PORT": str(port)}
            arguments = [*prefix, *(whole or (str(self.python), "-m", "bench_service", "serve"))]
            with command(arguments, port, own | (environment or {}), self.folder) as running:
                yield running

    def script(self, text: str) -> str:
        """Return the output of a script in its environment, with BLAS in one thread as the service has it."""
        environment = {**os.environ, "OPENBLAS_NUM_THREADS": "1", "OMP_NUM_THREADS": "1"}
        return _said([str(self.python), "-c", text], self.folder, environment)

    def compile(self) -> None:
        """Compile its packages: whoever comes first would otherwise pay for it."""
        packages = [name for name in OURS if (self.folder / name).is_dir()]
        alone = {name: value for name, value in os.environ.items() if name != "PYTHONDONTWRITEBYTECODE"}
        _said([str(self.python), "-m", "compileall", "-q", *packages], self.folder, alone)


def here() -> Revision:
    """This checkout."""
    return Revision("this", HERE)


@contextmanager
def built(name: str) -> Generator[Revision]:
    """An older revision in a temporary folder, with its own environment by its own Makefile; removed afterwards.

    Raises `subprocess.CalledProcessError` where there is no such revision, or it cannot be built.
    """
    commit = _said(["git", "-C", str(HERE), "rev-parse", "--verify", f"{name}^{{commit}}"])
    with tempfile.TemporaryDirectory(prefix="bench-revision-") as parent:
        folder = Path(parent) / "checkout"
        _said(["git", "-C", str(HERE), "worktree", "add", "--quiet", "--detach", str(folder), commit])
        try:
            _said(["make", "--no-print-directory", ".venv/.ready", f"PYTHON={sys.executable}"], folder)
            yield Revision(name, folder)
        finally:
            _said(["git", "-C", str(HERE), "worktree", "remove", "--force", str(folder)])


def _said(arguments: list[str], folder: Path | None = None, environment: dict[str, str] | None = None) -> str:
    alone = {name: value for name, value in (environment or os.environ).items() if name != "PYTHONPATH"}
    done = subprocess.run(arguments, cwd=folder, env=alone, text=True, stdout=subprocess.PIPE, check=True)
    return done.stdout.strip()
