"""The lines that the client's pages show are run as they stand, against a service at another port."""

import json
import re
from pathlib import Path
from textwrap import dedent
from typing import Any

import numpy as np
import pytest

from bench_client import Client

CLIENT = Path(__file__).parents[2] / "client"
SHOWN = "http://127.0.0.1:8000"


def run(lines: list[str], address: str, name: str) -> dict[str, Any]:
    """Run pieces of Python one after another, as one program; its names at the end, and its client closed."""
    assert SHOWN in lines[0]
    found: dict[str, Any] = {}
    try:
        for number, piece in enumerate(lines):
            exec(compile(piece.replace(SHOWN, address), f"{name}, piece {number}", "exec"), found)
    finally:
        if isinstance(found.get("client"), Client):
            found["client"].close()
    return found


def test_the_python_of_the_readme_runs(address: str, capsys: pytest.CaptureFixture[str]) -> None:
    pieces = re.findall(r"^```python\n(.*?)^```$", (CLIENT / "README.md").read_text(), re.DOTALL | re.MULTILINE)
    assert len(pieces) == 2
    found = run(pieces, address, "README.md")
    assert found["job"].state == "succeeded"
    assert found["rates"].values.shape == (found["recording"].view.count, len(found["rates"].names))
    assert "100%" in capsys.readouterr().out


def test_the_python_of_the_project_s_readme_runs(address: str) -> None:
    text = (CLIENT.parent / "README.md").read_text()
    found = re.search(r"((?: {4}.*\n)*? {4}client = Client\(.*\n(?: {4}.*\n)+)", text)
    assert found is not None
    lines = run([dedent(found[1])], address, "README.md")
    assert lines["job"].state == "succeeded"
    assert len(lines["rates"].values) > 0


def test_the_cells_of_the_notebook_run(address: str) -> None:
    notebook = json.loads((CLIENT / "first_calibration.ipynb").read_text())
    cells = [cell for cell in notebook["cells"] if cell["cell_type"] == "code"]
    assert all(cell["outputs"] == [] and cell["execution_count"] is None for cell in cells), "kept without outputs"
    found = run([cell["source"] for cell in cells], address, "first_calibration.ipynb")
    np.testing.assert_allclose(found["magnitudes"], 9.81, atol=0.02)  # the Earth's gravity, whatever the site
    assert found["curve"].tau_s[0] > 0


def test_the_lines_of_the_package_are_those_of_the_readme() -> None:
    """Names that the package's docstring uses exist."""
    from bench_client import __doc__ as shown

    calls = set(re.findall(r"client\.(\w+)\(", shown or ""))
    assert calls >= {"submit", "wait", "result_of", "recording"}
    assert [name for name in calls if not hasattr(Client, name)] == []
