"""Messages of the set-up when it cannot go on, and what it installs."""

import importlib.util
import re
import sys
from pathlib import Path
from types import ModuleType

import pytest

ROOT = Path(__file__).resolve().parents[2]


def preflight() -> ModuleType:
    specification = importlib.util.spec_from_file_location("preflight", ROOT / ".preflight.py")
    assert specification is not None
    assert specification.loader is not None
    module = importlib.util.module_from_spec(specification)
    specification.loader.exec_module(module)
    return module


def test_this_machine_lacks_nothing() -> None:
    assert preflight().missing() is None


def test_an_old_python_is_named_in_one_line(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(sys, "version_info", (3, 9, 18))
    problem = preflight().missing()
    assert "3.9.18" in problem
    assert "3.11" in problem
    assert "\n" not in problem


def test_a_python_without_venv_is_named_in_one_line(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "venv", None)
    problem = preflight().missing()
    assert "python3-venv" in problem
    assert "\n" not in problem


def test_the_lock_holds_versions_and_hashes_and_no_address() -> None:
    lock = (ROOT / "requirements.lock").read_text()
    packages = re.findall(r"^[a-z0-9].*$", lock, re.MULTILINE)
    assert len(packages) > 50
    assert all(re.match(r"[a-z0-9._-]+(\[[a-z,]+\])?==", line) for line in packages)
    assert "://" not in lock
    assert lock.count("--hash=sha256:") >= len(packages)
