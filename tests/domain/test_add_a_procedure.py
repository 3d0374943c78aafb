"""The page that says how to add a procedure: its example and that example's test are run as they stand there."""

import re
import sys
from collections.abc import Callable, Generator
from pathlib import Path
from types import ModuleType

import pytest

from procedures import catalog
from tests.kit.procedures import run

PAGE = (Path(__file__).resolve().parents[2] / "docs" / "add-a-procedure.md").read_text(encoding="utf-8")
EXAMPLE, ITS_TEST = re.findall(r"```python\n(.*?)```", PAGE, re.DOTALL)
(SHOWN,) = re.findall(r"```text\n(.*?)```", PAGE, re.DOTALL)
SEED, DWELL_S = 3, 20.0
NAME = f"{catalog.__name__}.six_faces"
TESTS = re.findall(r"^def (test_\w+)", ITS_TEST, re.MULTILINE)


@pytest.fixture(scope="module")
def example() -> Generator[ModuleType]:
    """The example, as if it were a file of the catalogue."""
    module = ModuleType(NAME)
    with pytest.MonkeyPatch.context() as patched:
        patched.setitem(sys.modules, NAME, module)
        exec(compile(EXAMPLE, "six_faces.py", "exec"), vars(module))
        yield module


def test_the_command_and_the_figures_of_the_page_are_those_of_the_example(example: ModuleType) -> None:
    assert f"bench run six_faces --unit SIM-0001 --seed {SEED} --set dwell_s={DWELL_S:g}\n" in PAGE
    result = run(example.PROCEDURE, seed=SEED, dwell_s=DWELL_S)
    lines = [f"{e.name:18}{e.estimate:.5f} ± {e.standard_uncertainty:.1e} {e.unit}" for e in result.estimates]
    assert result.verdict == "pass"
    assert "\n".join(lines) + "\n" == SHOWN


def test_the_page_has_a_test_for_its_example() -> None:
    assert len(TESTS) == 3


@pytest.mark.parametrize("name", TESTS)
def test_the_test_of_the_example_passes(example: ModuleType, name: str) -> None:
    space: dict[str, Callable[[], None]] = {}
    exec(compile(ITS_TEST, "test_six_faces.py", "exec"), space)
    space[name]()
