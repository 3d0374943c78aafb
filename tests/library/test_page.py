"""The page of the library: every line of Python on it runs, in one sitting, and draws the pictures beside it."""

import contextlib
import io
import re
from pathlib import Path

import pytest

from bench_service.formats.calibration_exports.own_json import own_json
from tests.kit.exported_calibrations import a_subject

ROOT = Path(__file__).resolve().parents[2]
PAGE = ROOT / "docs" / "library.md"


def test_the_lines_of_the_page_run(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "U-1-json.json").write_text(own_json(a_subject()))
    blocks = re.findall(r"```python\n(.*?)```", PAGE.read_text(), re.DOTALL)
    assert len(blocks) >= 4
    names: dict[str, object] = {}
    printed = io.StringIO()
    with contextlib.redirect_stdout(printed):
        for block in blocks:
            exec(compile(block, str(PAGE), "exec"), names)
    assert "N 0.00499" in printed.getvalue()
    assert "K11 1.00" in printed.getvalue()
    for name in ("allan", "residuals"):
        assert (tmp_path / f"{name}.png").stat().st_size > 5000
        assert (ROOT / "docs" / "pictures" / f"library-{name}.png").exists()
