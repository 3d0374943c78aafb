"""``make mutants``: small defects in the modules that must not have any, and how many of them the tests see.

    python -m tests.mutants [--tools .venv-mutants/bin] [--mutants 15] [--seed 1] [--only supervisor,lease]

cosmic-ray changes one operator, number, decorator or condition at a time, in a copy of this checkout; each of a fixed
random sample of places gets one mutant, and the module's own tests run against it. Printed are the killed and the
survivors with what was changed. A survivor is a question to a reader: a missing assertion, or a change that changes
nothing. Exit code 1 where the tests fail without any defect. A mutant costs as much as its module's tests: about 15
minutes for all on two idle cores.
"""

import argparse
import json
import os
import random
import shutil
import sqlite3
import subprocess
import sys
import tempfile
from contextlib import closing
from pathlib import Path

from tests.mutants.subjects import SUBJECTS, Subject

ROOT = Path(__file__).resolve().parents[2]
LONGEST_S = 120.0
"""A mutant that makes its tests hang is killed after this [s]: seen, too."""


def main() -> int:
    """Run the sample of each subject and print what became of it; the exit code."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--tools", type=Path, default=ROOT / ".venv-mutants/bin")
    parser.add_argument("--mutants", type=int, default=15, help="of each module")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--only", default="", help="names of subjects")
    given = parser.parse_args()
    wanted = [one for one in SUBJECTS if not given.only or one.name in given.only.split(",")]
    sound = True
    with tempfile.TemporaryDirectory(prefix="mutants-") as folder:
        copy = _copy(Path(folder) / "bench")
        for subject in wanted:
            command = [sys.executable, *_pytest(Path(folder)), *subject.tests]
            sane = subprocess.run(command, cwd=copy, env=_environment(), capture_output=True, text=True, check=False)
            if sane.returncode:
                print(f"{subject.name}: its tests fail without any defect: {sane.stdout[-1500:]}{sane.stderr[-500:]}")
                sound = False
                continue
            _run(subject, given.tools.resolve() / "cosmic-ray", copy, command, given.mutants, given.seed)
    return 0 if sound else 1


def _copy(to: Path) -> Path:
    """Copy what git knows of this checkout, as it is now."""
    names = subprocess.run(["git", "ls-files", "-z"], cwd=ROOT, capture_output=True, check=True).stdout.decode()
    for name in filter(None, names.split("\0")):
        if (ROOT / name).is_file():
            (to / name).parent.mkdir(parents=True, exist_ok=True)
            shutil.copy(ROOT / name, to / name)
    return to


def _pytest(folder: Path) -> list[str]:
    return ["-m", "pytest", "-x", "-q", "-p", "no:xdist", "-p", "no:cacheprovider", f"--basetemp={folder / 'tests'}"]


def _environment() -> dict[str, str]:
    """The copy's packages come first; one thread for each process."""
    return {**os.environ, "PYTHONPATH": ".", "PYTHONDONTWRITEBYTECODE": "1", "OPENBLAS_NUM_THREADS": "1"}


def _run(subject: Subject, cosmic_ray: Path, copy: Path, command: list[str], most: int, seed: int) -> None:
    settings, session = copy / "mutants.toml", copy / "mutants.sqlite"
    session.unlink(missing_ok=True)
    line = " ".join(f"'{word}'" if " " in word else word for word in command)
    settings.write_text(
        f'[cosmic-ray]\nmodule-path = "{subject.module}"\ntimeout = {LONGEST_S}\nexcluded-modules = []\n'
        f'test-command = "{line}"\n[cosmic-ray.distributor]\nname = "local"\n'
    )
    _asked(copy, cosmic_ray, "init", settings, session)
    places = _sample(session, most, seed)
    _asked(copy, cosmic_ray, "exec", settings, session)
    said = _asked(copy, cosmic_ray, "dump", session)
    results = [json.loads(one)[1] for one in said.splitlines()]
    survivors = [one for one in results if one["test_outcome"] == "survived"]
    print(f"{subject.name}: {len(results) - len(survivors)} of {len(results)} killed ({places} places)", flush=True)
    for one in survivors:
        print("\n".join(f"    {part}" for part in one["diff"].splitlines()[3:]), flush=True)


def _asked(copy: Path, *command: Path | str) -> str:
    """Run a command in the copy; what it prints. Raises `CalledProcessError`."""
    done = subprocess.run(command, cwd=copy, env=_environment(), stdout=subprocess.PIPE, text=True, check=True)
    return done.stdout


def _sample(session: Path, most: int, seed: int) -> int:
    """Leave one mutant at each of a sample of places in the session; the number of places that there are."""
    with closing(sqlite3.connect(session)) as books, books:
        query = "SELECT start_pos_row, start_pos_col, operator_name, occurrence, job_id FROM mutation_specs"
        places: dict[tuple[int, int], list[str]] = {}
        for row, column, *_, job in sorted(books.execute(query)):
            places.setdefault((row, column), []).append(job)
        chance = random.Random(seed)
        chosen = [chance.choice(places[place]) for place in chance.sample(sorted(places), min(most, len(places)))]
        marks = ",".join("?" * len(chosen))
        for table in ("mutation_specs", "work_items"):
            books.execute(f"DELETE FROM {table} WHERE job_id NOT IN ({marks})", chosen)
    return len(places)


if __name__ == "__main__":
    sys.exit(main())
