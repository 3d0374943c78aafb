"""Programs by others, each in an environment of its own, run as processes."""

import json
import subprocess
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import pytest

ROOT = Path(__file__).parents[2]
PEERS = Path(__file__).parent / "peers"


def python_of(environment: str) -> Path:
    """Interpreter of an environment; skips the test, in one line, where it was not built."""
    python = ROOT / ".foreign" / environment / "bin" / "python"
    if not (python.parents[1] / ".ready").exists():
        pytest.skip(f"the programs of tests/foreign/{environment}.lock are absent: make foreign")
    return python


def asked(environment: str, script: str, *arguments: object, given: str = "") -> Any:
    """Run a script to its end and read the JSON of its last line."""
    command = [str(python_of(environment)), str(PEERS / script), *map(str, arguments)]
    done = subprocess.run(command, input=given, capture_output=True, text=True, timeout=60.0, check=False)
    assert done.returncode == 0, done.stderr
    return json.loads(done.stdout.strip().splitlines()[-1])


@contextmanager
def running(environment: str, script: str) -> Iterator[subprocess.Popen[str]]:
    """Run a script that serves until its input ends."""
    command = [str(python_of(environment)), str(PEERS / script)]
    with subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True) as process:
        try:
            yield process
        finally:
            process.kill()


def told(process: subprocess.Popen[str], line: str = "") -> str:
    """Write a line, if any, and read the next one."""
    assert process.stdin is not None
    assert process.stdout is not None
    if line:
        process.stdin.write(f"{line}\n")
        process.stdin.flush()
    return process.stdout.readline().strip()
