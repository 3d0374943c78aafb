"""Run of ``bench`` with its output: as a process of its own, or in this one where the process is not the point."""

import io
import json
import os
import subprocess
import sys
from collections.abc import Callable
from contextlib import chdir, redirect_stderr, redirect_stdout
from pathlib import Path
from typing import Any
from unittest.mock import patch

from bench_service import __main__

ROOT = Path(__file__).parents[2]


class Done:
    """A command that has ended, with code and output."""

    def __init__(self, code: int, out: str, err: str) -> None:
        self.code, self.out, self.err = code, out, err
        assert "Traceback" not in out + err, err

    def json(self) -> Any:
        return json.loads(self.out)


Command = Callable[..., Done]


def environment(folder: Path, **settings: str) -> dict[str, str]:
    """Environment with no settings but those of the test."""
    outer = {k: v for k, v in os.environ.items() if not k.startswith("BENCH_")}
    given = {"BENCH_DATABASE_URL": f"sqlite:///{folder / 'bench.sqlite'}", **settings}
    return {**outer, "COLUMNS": "200", "PYTHONPATH": str(ROOT), **given}


def command_in(folder: Path) -> Command:
    def run(*arguments: object, **settings: str) -> Done:
        done = subprocess.run(
            [sys.executable, "-m", "bench_service", *map(str, arguments)],
            env=environment(folder, **settings),
            cwd=folder,
            capture_output=True,
            text=True,
            timeout=120,
            check=False,
        )
        return Done(done.returncode, done.stdout, done.stderr)

    return run


def command_here(folder: Path) -> Command:
    """The same entry point with the same arguments, environment and folder, without the second of a start."""

    def run(*arguments: object, **settings: str) -> Done:
        out, err = io.StringIO(), io.StringIO()
        with (
            patch.dict(os.environ, environment(folder, **settings), clear=True),
            patch.object(sys, "argv", ["bench", *map(str, arguments)]),
            chdir(folder),
            redirect_stdout(out),
            redirect_stderr(err),
        ):
            try:
                __main__.main()
            except SystemExit as end:
                code = end.code
        assert isinstance(code, int)
        return Done(code, out.getvalue(), err.getvalue())

    return run


def one_line(done: Done, *words: str) -> None:
    """Require a refusal: exit code 2, nothing on standard output, one line with these words on standard error."""
    assert (done.code, done.out) == (2, ""), done.err
    assert len(done.err.strip().splitlines()) == 1, done.err
    assert done.err.startswith("bench: ")
    assert all(word in done.err for word in words), done.err
