"""Imports of the command line and of a service before its first answer: what is heavy there delays every start."""

import json
import subprocess
import sys

import pytest

NUMERICS = ("scipy", "matplotlib", "mujoco", "pywt")
READERS = ("h5py", "nptdms", "rosbags", "pyarrow.dataset")
FOR_SOME = ("argon2", "httpx", "pymodbus", "serial", "opentelemetry.sdk", "junitparser", "alembic", "dbos")
SERVING = (*NUMERICS, *READERS, *FOR_SOME, "pyarrow", "jinja2", "bench_service.nouns")
"""Packages and modules that a server loads after its first answer, or not at all."""
COMMANDS = (*SERVING, "numpy", "sqlalchemy", "fastapi", "uvicorn", "procedures", "simulators")
"""Packages that the help of the command line does without."""


def loaded_by(module: str) -> set[str]:
    """The names of all modules that are loaded in a fresh interpreter once `module` is imported."""
    code = f"import json, sys, {module}; print(json.dumps(list(sys.modules)))"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    return set(json.loads(done.stdout))


@pytest.mark.parametrize(
    ("module", "without"),
    [("bench_service.cli.commands", COMMANDS), ("bench_service.cli.processes.serving", SERVING)],
)
def test_a_start_loads_nothing_that_it_can_do_without(module: str, without: tuple[str, ...]) -> None:
    loaded = loaded_by(module)
    assert module in loaded
    assert sorted(loaded & set(without)) == []
