"""Synthetic recordings through REST: noise of chosen coefficients, marked for ever, of no unit's history."""

import html
import io
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from rich.console import Console

from bench_service.cli.printing.check_tables import check_table
from bench_service.evidence.reports.result_report import verdict_blocks
from bench_service.formats.printed.document import PrintedTable
from procedures.core import units
from procedures.core.limits import Verdict
from procedures.core.noise import NoiseCoefficients
from simulators.imu.synthesis import synthesise
from tests.service.client import Client

ADDRESS = "/api/v1/recordings/synthetic"
ASKED = {"quantization": 0.4, "random_walk": 0.0015, "rate_hz": 20.0, "duration_s": 7200.0, "seed": 5}


@pytest.fixture(scope="module")
def made(sqlite_client: Client) -> dict:
    answer = sqlite_client.http.post(ADDRESS, json=ASKED, headers={"Idempotency-Key": "one record"})
    assert answer.status_code == 201, answer.text
    assert answer.headers["Location"] == f"/api/v1/recordings/{answer.json()['id']}"
    return answer.json()


def test_it_is_marked_and_of_no_unit(sqlite_client: Client, made: dict) -> None:
    assert (made["unit"], made["simulated"], made["count"]) == ("SYNTHETIC", True, 144_000)
    assert made["source"]["origin"] == "synthetic"
    assert made["source"]["synthetic"]["noise"]["quantization"] == pytest.approx(0.4 * units.ARCSEC)
    again = sqlite_client.http.post(ADDRESS, json=ASKED, headers={"Idempotency-Key": "one record"})
    assert again.json()["id"] == made["id"]
    twin = sqlite_client.http.post(ADDRESS, json=ASKED).json()
    assert (twin["content_hash"], twin["id"] == made["id"]) == (made["content_hash"], False)


def test_a_method_finds_what_was_put_in_and_no_unit_has_the_result(sqlite_client: Client, made: dict) -> None:
    body = {"method": "noise_analysis", "recordings": [made["id"]], "parameters": {"trim": "none", "wavelet": "none"}}
    answer = sqlite_client.http.post("/api/v1/analyses", json=body)
    assert answer.status_code == 201, answer.text
    result = answer.json()
    assert result["unit"] == "SYNTHETIC"
    (channel,) = (result.get("document") or result["result"])["launches"][0]["channels"]
    found = {c["process"]: c["likelihood"] for c in channel["coefficients"]}
    for process, size, true in (
        ("quantization", units.ARCSEC, 0.4),
        ("random_walk", units.DEG_PER_SQRT_HOUR, 0.0015),
    ):
        reading = found[process]
        assert abs(reading["value"] / size - true) < 4.5 * reading["standard_uncertainty"] / size
    assert found["rate_random_walk"]["value"] is None


def test_what_was_not_observed_is_inconclusive_on_page_terminal_and_paper(sqlite_client: Client, made: dict) -> None:
    """White noise alone shows no bias instability; two hours bound it above so small a limit."""
    limits = {"gyro_random_walk_deg_sqrt_h": 0.002, "gyro_bias_in_run_deg_h": 1e-5}
    parameters = {"trim": "none", "wavelet": "none", "noise_limits": limits}
    body = {"method": "noise_analysis", "recordings": [made["id"]], "parameters": parameters}
    result = sqlite_client.http.post("/api/v1/analyses", json=body).json()
    assert (result["verdict"], result["document"]["statement"]["outcome"]) == ("error", "inconclusive")
    console = Console(file=io.StringIO(), width=200)
    console.print(check_table(result["document"]))
    terminal = console.file.getvalue()  # pyright: ignore[reportAttributeAccessIssue]
    stored: Any = SimpleNamespace(verdict=Verdict.ERROR, document=result["document"])
    paper = next(block for block in verdict_blocks(stored) if isinstance(block, PrintedTable))
    page = sqlite_client.http.get(f"/results/{result['id']}").text
    for shown in (terminal, str(paper), html.unescape(page)):
        assert "the request" in shown
        assert "inconclusive" in shown
        assert "< 0.0" in shown
        assert "not observed: the value is what it stays below" in shown
    assert "1 of 2 checks passed, 1 inconclusive" in page


def test_its_serial_belongs_to_nothing_else(sqlite_client: Client, made: dict) -> None:
    declared = sqlite_client.http.put("/api/v1/units/SYNTHETIC", json={"sample_rate_hz": 100.0})
    assert declared.status_code == 422
    assert "synthetic recordings" in declared.text
    job = sqlite_client.http.post("/api/v1/jobs", json={"procedure": "no_operation", "unit": "SYNTHETIC"})
    assert job.status_code in (404, 409, 422)


def test_bad_requests_name_the_field(sqlite_client: Client) -> None:
    for body, field in (
        ({"random_walk": -1.0}, "random_walk"),
        ({"kind": "compass"}, "kind"),
        ({"rate_hz": 10_000.0, "duration_s": 1e6}, "duration_s"),
    ):
        answer = sqlite_client.http.post(ADDRESS, json=body)
        assert answer.status_code == 422
        assert answer.json()["errors"][0]["field"].endswith(field)


def test_the_library_function_gives_the_same_record_in_any_length() -> None:
    noise = NoiseCoefficients(2e-6, 4e-7, 1e-8, 1e-9, 1e-13)
    long, short = (np.concatenate(list(synthesise(noise, 50.0, n, 3))) for n in (120_000, 60_000))
    assert np.array_equal(long[:60_000], short)
    assert not np.array_equal(long[:1000], next(synthesise(noise, 50.0, 1000, 4)))
    # White: N²·f; readings: 2Q²·f². The variance of 120 000 values is known to √(2/n) = 0.4 %, correlated a little.
    expected = noise.random_walk**2 * 50.0 + 2.0 * (noise.quantization * 50.0) ** 2
    assert np.var(long) == pytest.approx(expected, rel=0.02)
