"""The library as a distribution of its own: its wheel works where only its three dependencies can be imported."""

import shutil
import subprocess
import sys
import zipfile
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
ALLOWED = ("numpy", "scipy", "pywt", "procedures")
LINES = """
import sys
class Only:
    def find_spec(self, name, path=None, target=None):
        top = name.partition(".")[0]
        if top not in {allowed} and top not in sys.stdlib_module_names and not top.startswith("_sysconfigdata"):
            raise ModuleNotFoundError(f"{{name}} is not a dependency of the library", name=name)
sys.meta_path.insert(0, Only())
import procedures.library as inertial
assert "scipy" not in sys.modules, "the import waits for scipy"
assert inertial.__file__.startswith({folder!r}), inertial.__file__
for name in inertial.__all__:
    getattr(inertial, name)
import numpy as np
y = np.random.default_rng(1).normal(size=2000)
print(inertial.allan(y, 10.0).deviation[0], inertial.noise(y, 10.0).coefficients["N"].value)
"""


@pytest.fixture(scope="module")
def unpacked(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Wheel of the library, built from a copy of its folder and unpacked."""
    folder = tmp_path_factory.mktemp("wheel")
    ignored = shutil.ignore_patterns("__pycache__", "build", "*.egg-info")
    shutil.copytree(ROOT / "procedures", folder / "source", ignore=ignored)
    build = "from setuptools.build_meta import build_wheel; build_wheel('..')"
    done = subprocess.run(
        [sys.executable, "-c", build], cwd=folder / "source", capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, done.stderr
    (wheel,) = folder.glob("*.whl")
    with zipfile.ZipFile(wheel) as packed:
        packed.extractall(folder / "unpacked")
    return folder / "unpacked"


def test_the_wheel_works_without_the_service(unpacked: Path) -> None:
    lines = LINES.format(allowed=ALLOWED, folder=str(unpacked))
    command = [sys.executable, "-c", lines]
    done = subprocess.run(
        command, cwd=unpacked, env={"PYTHONPATH": str(unpacked)}, capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, done.stderr
    assert all(float(number) > 0.0 for number in done.stdout.split())


def test_the_wheel_holds_every_module_of_its_rooms_and_no_other(unpacked: Path) -> None:
    rooms = ("core", "analysis", "library")
    expected = {str(p.relative_to(ROOT)) for room in rooms for p in (ROOT / "procedures" / room).rglob("*.py")}
    expected |= {f"procedures/{room}/py.typed" for room in rooms}
    found = {
        str(p.relative_to(unpacked)) for p in (unpacked / "procedures").rglob("*") if p.suffix in (".py", ".typed")
    }
    assert found == expected
