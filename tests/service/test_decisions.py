"""Decision rules and uncertainty budgets through REST, on the page, on a terminal and in a certificate's source."""

import io
from typing import Any

import pytest
from rich.console import Console

from bench_service.cli.printing.check_tables import budget_table, check_table
from procedures.core.limits import coverage_factor
from tests.service.client import FAST, Client

GUARDED = {"rule": "guarded", "by_check": {"gyro condition number": "simple"}}


@pytest.fixture(scope="module")
def result(sqlite_client: Client) -> dict[str, Any]:
    parameters = {**FAST, "decision": GUARDED, "budget_sources": ["noise", "pointing", "azimuth"]}
    job = sqlite_client.wait(sqlite_client.submit(seed=3, parameters=parameters)["id"])
    assert job["state"] == "succeeded", job
    return sqlite_client.http.get(f"/api/v1/results/{job['result']}").json()


def printed(table: Any) -> str:
    console = Console(file=io.StringIO(), width=200)
    console.print(table)
    return console.file.getvalue()  # pyright: ignore[reportAttributeAccessIssue]


def test_every_check_says_its_rule_and_its_expanded_uncertainty(result: dict[str, Any]) -> None:
    checks = {c["name"]: c for c in result["document"]["checks"]}
    in_run = checks["gyro bias in run, δ/√3"]
    made = in_run["decision"]
    assert made["rule"] == "guard band of 1·U"
    assert made["degrees_of_freedom"] == in_run["degrees_of_freedom"] == 11.0
    assert made["coverage_factor"] == pytest.approx(coverage_factor(0.9545, 11.0))
    assert made["expanded_uncertainty"] == pytest.approx(made["coverage_factor"] * in_run["standard_uncertainty"])
    assert made["guard_band"] == made["expanded_uncertainty"]
    assert checks["gyro condition number"]["decision"]["rule"].startswith("simple acceptance")
    residuals = checks["gyro residuals, p-value of chi-square"]
    assert residuals["decision"]["rule"] == "test of significance at 0.001"
    statement = result["document"]["statement"]
    assert statement["rule"] == "guard band of 1·U; simple acceptance"
    assert statement["outcome"].endswith(result["verdict"])


def test_the_budgets_are_in_the_result_on_its_page_and_on_a_terminal(
    sqlite_client: Client, result: dict[str, Any]
) -> None:
    for triad in result["document"]["triads"]:
        for coefficient, budget in zip(triad["coefficients"], triad["budgets"], strict=True):
            assert budget["coefficient"] == coefficient["name"]
            squares = sum(row["contribution"] ** 2 for row in budget["rows"])
            assert squares**0.5 == pytest.approx(coefficient["standard_uncertainty"], rel=1e-9)
    page = sqlite_client.http.get(f"/results/{result['id']}").text
    assert "Uncertainty budget of the gyro triad" in page
    assert "Statement of conformity" in page
    text = printed(budget_table(result["document"], "gyro.K11"))
    assert "azimuth" in text
    assert "root sum of squares" in text
    with pytest.raises(KeyError, match="gyro"):
        budget_table(result["document"], "gyro.K99")
    assert "decision rule: guard band of 1·U" in printed(check_table(result["document"]))


def test_an_export_tells_the_statement(sqlite_client: Client, result: dict[str, Any]) -> None:
    path = "/api/v1/units/SIM-0001/calibrations"
    made = next(c["id"] for c in sqlite_client.http.get(path).json()["items"] if c["result"] == result["id"])
    exported = sqlite_client.http.get(f"{path}/{made}/export", params={"format": "json"}).json()
    assert exported["triads"][0]["lineage"]["statement"] == result["document"]["statement"]


@pytest.mark.parametrize(
    ("parameters", "field", "said"),
    [
        ({"decision": {"by_check": {"nothing": "guarded"}}}, "by_check", "gyro bias in run"),
        ({"decision": {"rule": "lenient"}}, "decision.rule", "'simple' or 'guarded'"),
        ({"decision": {"guard": 0.0}}, "decision.guard", "greater than 0"),
        ({"budget_sources": ["mounting"]}, "budget_sources", "give mounting_sd_arcsec"),
        ({"budget_sources": ["luck"]}, "budget_sources", "'noise'"),
    ],
)
def test_a_rule_or_a_source_that_cannot_be(
    sqlite_client: Client, parameters: dict[str, Any], field: str, said: str
) -> None:
    answer = sqlite_client.preview(**FAST, **parameters)
    assert answer.status_code == 422, answer.text
    (error,) = answer.json()["errors"][:1]
    assert field in error["field"]
    assert said in error["message"]
