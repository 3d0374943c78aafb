"""A field of a job: it is written in five places, and what lies between them carries it without knowing it."""

import json
import os
import re
import shutil
import subprocess
import sys
from dataclasses import dataclass, fields
from pathlib import Path

import pytest
from pydantic import BaseModel

from bench_service.api.jobs.schemas import JobSubmission, JobView
from bench_service.mapping import copied, field_names
from bench_service.model.job import Job
from bench_service.model.request import JobRequest, JobTerms
from bench_service.persistence.tables.jobs import JobRow

ROOT = Path(__file__).resolve().parents[2]
OTHERWISE_SHOWN = {"failure": "error", "result_id": "result", "stations": "progress", "stations_done": "progress"}
NOT_SHOWN = {"context", "cancel_requested"}
EDITS = (
    ("bench_service/model/request.py", r"(    reservation: str \| None = None\n)", r'\1    shift: str = ""\n'),
    ("bench_service/persistence/tables/jobs.py", r"(    requested_by: Mapped\[str\]\n)", r"\1    shift: Mapped[str]\n"),
    ("bench_service/api/jobs/schemas.py", r"(class JobSubmission(?s:.*?)procedure: .*\n)", r'\1    shift: str = ""\n'),
    ("bench_service/api/jobs/schemas.py", r"(class JobView(?s:.*?)code_version: .*\n)", r"\1    shift: str\n"),
)
MIGRATION = """
import sqlalchemy as sa
from alembic import op

revision, down_revision, branch_labels, depends_on = "9999", "{head}", None, None


def upgrade() -> None:
    op.add_column("jobs", sa.Column("shift", sa.String(), nullable=False, server_default=""))
"""
SUBMIT = """
import json, sys
from bench_service.cli.asking.client import connect
from bench_service.drivers.simulated import SimulatedDriver
from bench_service.persistence import open_stores
from bench_service.settings import Settings

settings, driver = Settings(database_url=sys.argv[1]), SimulatedDriver("sim")
stores, database = open_stores(settings.database_url)
for unit in driver.mounted():
    stores.units.put_unit(unit)
stores.benches.put_bench(driver.description, ["SIM-0001"])
with connect(settings, None, drive=False) as http:
    body = {"procedure": "no_operation", "unit": "SIM-0001", "shift": "night"}
    made = http.post("/api/v1/jobs", json=body).json()
    listed = http.get("/api/v1/jobs").json()["items"]
    print(json.dumps([made.get("shift"), [job["shift"] for job in listed], stores.jobs.get(made["id"]).shift]))
"""


def test_five_edits_take_a_new_field_from_the_request_to_the_answer(tmp_path: Path) -> None:
    """Tried on a copy: terms, column, migration, submission and view. Nothing else is told of the field."""
    for package in ("bench_service", "procedures", "simulators", "migrations"):
        shutil.copytree(ROOT / package, tmp_path / package, ignore=shutil.ignore_patterns("__pycache__"))
    shutil.copy(ROOT / "pyproject.toml", tmp_path)
    for name, found, changed in EDITS:
        text, times = re.subn(found, changed, (tmp_path / name).read_text(), count=1)
        assert times == 1, f"{name} has changed: {found}"
        (tmp_path / name).write_text(text)
    versions = tmp_path / "migrations" / "versions"
    head = max(path.name[:4] for path in versions.glob("*.py"))
    (versions / "9999_shift.py").write_text(MIGRATION.format(head=head))
    done = subprocess.run(
        [sys.executable, "-c", SUBMIT, f"sqlite:///{tmp_path}/bench.sqlite"],
        cwd=tmp_path,
        env={**os.environ, "PYTHONPATH": str(tmp_path)},
        capture_output=True,
        text=True,
        timeout=60,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    assert json.loads(done.stdout.splitlines()[-1]) == ["night", ["night"], "night"]


def test_what_a_client_may_ask_is_what_a_request_holds() -> None:
    assert set(field_names(JobSubmission)) == set(field_names(JobRequest))
    assert {field.name for field in fields(JobTerms)} <= {field.name for field in fields(Job)}


def test_every_field_of_a_job_is_stored() -> None:
    assert set(field_names(JobRow)) == set(field_names(Job))


def test_every_field_of_a_job_is_shown_or_is_known_not_to_be() -> None:
    shown = set(field_names(JobView))
    assert {OTHERWISE_SHOWN.get(name, name) for name in field_names(Job)} - shown == NOT_SHOWN


@dataclass(frozen=True)
class Source:
    name: str
    number: int

    @property
    def twice(self) -> int:
        return 2 * self.number


@dataclass(frozen=True)
class Target:
    name: str
    twice: int
    remark: str = "none"


class View(BaseModel):
    number: int
    remark: str


def test_fields_and_properties_are_copied_by_name_and_defaults_stay() -> None:
    assert copied(Target, Source("a", 2)) == Target("a", 4)
    assert copied(Target, Source("a", 2), twice=1, remark="given") == Target("a", 1, "given")
    assert copied(View, Target("a", 4), Source("a", 2)) == View(number=2, remark="none")


def test_a_field_that_nothing_gives_is_named() -> None:
    with pytest.raises(TypeError, match="View needs remark: Source has no such field"):
        copied(View, Source("a", 2))
    with pytest.raises(TypeError, match="JobRow needs created_at"):
        copied(JobRow, JobRequest(procedure="p", unit="u"), **dict.fromkeys(("id", "procedure_version", "state"), ""))


def test_a_name_that_is_no_field_is_refused() -> None:
    with pytest.raises(TypeError, match="Target has no field number"):
        copied(Target, Source("a", 2), number=3)
