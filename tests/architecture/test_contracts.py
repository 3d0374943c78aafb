"""The house's own rules: who may import whom, how long a file may be, what every catalogue entry provides."""

import ast
import json
import subprocess
import sys
from collections import Counter
from collections.abc import Iterator
from pathlib import Path

import pytest

from procedures import catalog, methods
from procedures.procedure import Outcome, Parameters
from tests.kit.source_facts import facts

ROOT = Path(__file__).resolve().parents[2]
PACKAGES = ("procedures", "simulators", "bench_service")
SOURCES = sorted(path for package in PACKAGES for path in (ROOT / package).rglob("*.py"))
FILE_LINES = 300
FUNCTION_LINES = 60
FOLDER_MODULES = 25
HEADLESS = ("What ", "Who ", "Whoever ", "Of ")
BANNED_NAMES = {"utils", "helpers", "common", "base", "manager", "misc", "types"}


def test_the_import_contracts_are_kept() -> None:
    command = [Path(sys.executable).parent / "lint-imports", "--no-cache"]
    done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=False)
    _, _, broken = done.stdout.partition("Broken contracts\n")
    assert done.returncode == 0, broken or done.stdout + done.stderr


def test_no_file_is_longer_than_a_sitting() -> None:
    long = {str(p.relative_to(ROOT)): n for p in SOURCES if (n := len(p.read_text().splitlines())) > FILE_LINES}
    assert not long, f"split by subject, not by size; more than {FILE_LINES} lines: {long}"


def test_no_folder_holds_more_modules_than_a_reader_can_survey() -> None:
    counts = Counter(str(p.parent.relative_to(ROOT)) for p in SOURCES if p.name != "__init__.py")
    full = {folder: n for folder, n in counts.items() if n > FOLDER_MODULES}
    assert not full, f"give a subject a room (a folder) of its own; more than {FOLDER_MODULES} modules: {full}"


def test_migrations_import_nothing_of_the_product() -> None:
    """A migration must do tomorrow what it did when it landed, whatever becomes of the product's code."""
    imports = {
        f"{path.name}: {name}"
        for path in (ROOT / "migrations" / "versions").glob("*.py")
        for name in _imported(path)
        if name.split(".")[0] in PACKAGES
    }
    assert not imports, f"copy what the migration needs into it, as it is today: {imports}"


def test_what_tests_share_lives_in_the_kit() -> None:
    """An import of another test module runs its tests' set-up, and ties two subjects that have nothing in common."""
    imports = {
        f"{path.relative_to(ROOT)}: {name}"
        for path in (ROOT / "tests").rglob("test_*.py")
        for name in _imported(path)
        if name.startswith("tests.") and name.rsplit(".", 1)[-1].startswith("test_")
    }
    assert not imports, f"move what is shared into tests/kit: {imports}"


def _imported(path: Path) -> Iterator[str]:
    for node in ast.walk(ast.parse(path.read_text())):
        if isinstance(node, ast.ImportFrom):
            yield node.module or ""
        elif isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names)


def test_no_docstring_begins_with_a_relative_clause() -> None:
    """A summary names its noun or its verb: "Return the job …" and "The job that …", not "What runs" or "Of a job"."""
    opened = [
        f"{path.relative_to(ROOT)}: {summary}"
        for path in SOURCES
        for defined in facts(path).definitions
        if (summary := defined.docstring.split("\n")[0]).startswith(HEADLESS)
    ]
    assert opened == []


def test_no_function_is_longer_than_a_page() -> None:
    long = [
        f"{path.relative_to(ROOT)}:{defined.name} has {defined.lines} lines"
        for path in SOURCES
        for defined in facts(path).definitions
        if defined.lines > FUNCTION_LINES
    ]
    assert not long, f"name a part of it as a function; more than {FUNCTION_LINES} lines: {long}"


def test_every_module_says_what_it_knows_and_none_is_called_utils() -> None:
    silent = [str(p.relative_to(ROOT)) for p in SOURCES if not facts(p).definitions[0].docstring]
    assert not silent, f"begin with a docstring: what the module knows, and what it must not know: {silent}"
    vague = [str(p.relative_to(ROOT)) for p in SOURCES if p.stem in BANNED_NAMES]
    assert not vague, f"name a module by its subject: {vague}"


@pytest.mark.parametrize("entry", [*catalog.discover().values(), *methods.discover().values()], ids=lambda e: e.name)
def test_every_entry_has_a_schema_that_a_client_can_read(entry) -> None:
    assert issubclass(entry.params, Parameters)
    assert issubclass(entry.result, Outcome)
    assert entry.title
    assert entry.version.count(".") == 2
    for model in (entry.params, entry.result):
        json.dumps(model.model_json_schema(), allow_nan=False)


def test_only_one_file_reads_the_wall_clock_or_makes_chance() -> None:
    """Ruff checks what imports cannot show; its rule is switched off for no other file than the one."""
    allowed = {"bench_service/wall_clock.py", "bench_service/bench/session.py"}
    with_exception = {str(p.relative_to(ROOT)) for p in SOURCES if "noqa: TID251" in p.read_text()}
    assert with_exception <= allowed, (
        f"take the time from bench.clock or wall_clock, chance as an argument: {with_exception - allowed}"
    )
