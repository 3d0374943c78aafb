"""Names that are markup are shown on the pages, and not run."""

from collections.abc import Generator
from pathlib import Path

import pytest

from bench_service.cli.asking.client import connect
from bench_service.settings import Settings
from tests.service.client import FAST, Client
from tests.service.page import page

EVIL = "<script>alert(1)</script>"


@pytest.fixture
def evil(tmp_path: Path) -> Generator[Client]:
    """A bench and a unit whose names are markup."""
    truths = Path(__file__).parents[2] / "simulators" / "truths"
    unit = (truths / "default_unit.toml").read_text().replace('"SIM-0001"', f'"{EVIL}"')
    bench = (truths / "default_bench.toml").read_text().replace('"Simulated three-axis bench"', f'"{EVIL}"')
    (tmp_path / "unit.toml").write_text(unit)
    (tmp_path / "bench.toml").write_text(bench)
    settings = Settings(
        database_url=f"sqlite:///{tmp_path / 'bench.sqlite'}",
        unit_truth=tmp_path / "unit.toml",
        bench_truth=tmp_path / "bench.toml",
    )
    with connect(settings, None, drive=True) as http:
        yield Client(http)


def test_a_name_that_is_markup_is_shown_and_not_run(evil: Client) -> None:
    body = {"procedure": "calibration_12_orientations", "unit": EVIL, "parameters": FAST, "labels": {EVIL: EVIL}}
    job = evil.wait(evil.http.post("/api/v1/jobs", json=body).json()["id"])
    assert job["state"] == "succeeded"
    for path in ("/", job["page"], f"/results/{job['result']}"):
        text = evil.http.get(path).text
        shown = page(evil, path)
        assert EVIL in shown.words
        assert EVIL not in text
        assert shown.tags.count("script") == text.count('<script src="/static/')
