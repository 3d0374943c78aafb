"""A process that nothing bounds: infinite in the analysis, null and "unbounded" wherever a result is kept and shown."""

import html
import io
from collections.abc import Generator
from dataclasses import replace
from math import inf
from typing import Any

import httpx
import numpy as np
import pytest
from rich.console import Console

from bench_service.campaigns.campaign import Campaign
from bench_service.campaigns.judgement import judge
from bench_service.campaigns.junit import document as junit
from bench_service.campaigns.run import CampaignRun, StepRun, StepState
from bench_service.campaigns.stores import Stores
from bench_service.cli.asking.client import connect
from bench_service.cli.printing.check_tables import check_table
from bench_service.evidence.documents import document_of
from bench_service.evidence.reports.result_report import verdict_blocks
from bench_service.evidence.trend import value_of
from bench_service.formats.printed.document import PrintedTable
from bench_service.model.errors import NotFound
from bench_service.model.job import JobState
from bench_service.model.records import StoredResult
from bench_service.notifications.messages import of_run
from bench_service.persistence import open_stores
from bench_service.settings import Settings
from bench_service.wall_clock import new_id, now
from procedures.analysis.launch import channel
from procedures.analysis.noise_fit.estimate import Estimate
from procedures.core.limits import Limit, Verdict, check, upper_bound, verdict
from procedures.core.noise import NoiseCoefficients
from procedures.core.recording import Channel, MemoryRecording, Quantity, RecordingInfo
from procedures.inspection import analyse_method
from procedures.methods.noise_analysis import METHOD, Params, Result
from procedures.procedure import Evidence

FLICKER = "gyro_x bias instability"
CHANNELS = (Channel("gyro_x", Quantity.ANGULAR_RATE, "rad/s"),)


def analysed() -> Result:
    """Ten minutes of white noise whose fit says of the flicker, and of a value's upper end, that no limit is known."""
    infinite = pytest.MonkeyPatch()
    of = channel._of

    def without_limit(estimate: Estimate) -> Any:
        return of(replace(estimate, upper_limit=inf, upper=None if estimate.upper is None else inf))

    infinite.setattr(channel, "_of", without_limit)
    samples = np.random.default_rng(7).normal(size=(12_000, 1)) * 1e-5
    recording = MemoryRecording(RecordingInfo("r", "MY-1", CHANNELS, 20.0, len(samples)), samples)
    limits = {"gyro_bias_in_run_deg_h": 0.015}
    params = Params.model_validate({"wavelet": "none", "trim": "none", "noise_limits": limits})
    try:
        return analyse_method(METHOD, Evidence(recordings=(recording,)), params, None)
    finally:
        infinite.undo()


@pytest.fixture(scope="module")
def outcome() -> Result:
    return analysed()


@pytest.fixture(scope="module")
def url(tmp_path_factory: pytest.TempPathFactory) -> str:
    return f"sqlite:///{tmp_path_factory.mktemp('service') / 'bench.sqlite'}"


@pytest.fixture(scope="module")
def service(url: str) -> Generator[httpx.Client]:
    with connect(Settings(database_url=url), None, drive=True) as http:
        yield http


@pytest.fixture(scope="module")
def stores(url: str, service: httpx.Client) -> Generator[Stores]:
    """The database of the running service, opened beside it."""
    opened, database = open_stores(url)
    yield opened
    database.dispose()


@pytest.fixture(scope="module")
def result(outcome: Result, stores: Stores) -> StoredResult:
    found = StoredResult(
        id=new_id(),
        kind="method",
        name=METHOD.name,
        version=METHOD.version,
        parameters=Params().model_dump(mode="json"),
        document=document_of(outcome),
        verdict=outcome.verdict,
        recordings=(),
        calibrations=(),
        code_version="abc",
        simulated=True,
        created_at=now(),
    )
    stores.results.add(found)
    return found


def test_an_infinite_bound_decides_nothing_and_has_no_value() -> None:
    found = upper_bound("flicker", inf, Limit("deg/h", maximum=1.0))
    assert (found.value, found.passed, found.inconclusive, verdict([found])) == (None, False, True, Verdict.ERROR)
    assert found.note == "not observed: unbounded, nothing limits it from above"
    assert check("flicker", inf, Limit("deg/h", maximum=1.0)).value == inf, "no bound: a defect, and refused as one"


def test_the_document_has_null_and_the_reason(outcome: Result, result: StoredResult) -> None:
    (found,) = (c for c in result.document["checks"] if c["name"] == FLICKER)
    assert (found["value"], found["bound"], found["decision"]["outcome"]) == (None, True, "inconclusive")
    (of_channel,) = result.document["launches"][0]["channels"]
    readings = {c["process"]: c["likelihood"] for c in of_channel["coefficients"]}
    absent, walk = readings["bias_instability"], readings["random_walk"]
    assert (absent["upper_limit"], absent["unbounded"]) == (None, True)
    assert walk["lower"] is not None
    assert walk["upper"] is None
    assert Result.model_validate(result.document) == outcome


def test_a_record_learns_nothing_from_it(outcome: Result) -> None:
    """A launch that bounds nothing leaves what the record had; zero would claim that there is no flicker."""
    known = NoiseCoefficients(1.0, 2.0, 3.0, 4.0, 5.0)
    (summary,) = outcome.channels
    assert summary.noise_over(known).bias_instability == known.bias_instability
    assert summary.noise_over(None).bias_instability == 0.0
    assert summary.noise_over(known).random_walk == pytest.approx(1e-5 / np.sqrt(20.0), rel=0.05)


def test_terminal_paper_page_and_api_say_unbounded(service: httpx.Client, result: StoredResult) -> None:
    console = Console(file=io.StringIO(), width=200)
    console.print(check_table(result.document))
    terminal = console.file.getvalue()  # pyright: ignore[reportAttributeAccessIssue]
    paper = next(block for block in verdict_blocks(result) if isinstance(block, PrintedTable))
    page = html.unescape(service.get(f"/results/{result.id}").text)
    for shown in (terminal, str(paper), page):
        assert "not observed: unbounded, nothing limits it from above" in shown
        assert "inconclusive" in shown
        assert "inf" not in shown.replace("inference", "").replace("infinit", "").replace("info", ""), shown
    assert '<td class="n">unbounded</td>' in page
    assert "– (unbounded)" in page, "the table of coefficients"
    answer = service.get(f"/api/v1/results/{result.id}")
    assert answer.json()["document"] == result.document
    printed = service.get(f"/api/v1/results/{result.id}/report.pdf")
    assert (printed.status_code, printed.content[:5]) == (200, b"%PDF-")


def test_a_trend_has_no_value_of_it(stores: Stores, result: StoredResult) -> None:
    with pytest.raises(NotFound, match="unbounded"):
        value_of(result, FLICKER)


def test_a_campaigns_limit_on_it_is_inconclusive(result: StoredResult) -> None:
    limit = {"quantity": FLICKER, "unit": "deg/h", "maximum": 1.0, "source": "ours"}
    campaign = Campaign.model_validate(
        {"name": "t", "steps": [{"name": "a", "procedure": "static_run", "limits": [limit]}]}
    )
    nothing: Any = None
    made = judge(campaign.steps[0], campaign, result, nothing)
    assert made.verdict is Verdict.ERROR
    assert f"{FLICKER}, campaign's limit is inconclusive" in made.reason
    step = StepRun("a", "static_run", StepState.FAILED, verdict=Verdict.ERROR, checks=made.checks, reason=made.reason)
    run = CampaignRun("run", campaign, "U", "sim", JobState.FAILED, now(), (step,), verdict=Verdict.ERROR)
    assert f"inconclusive: {FLICKER} = unbounded deg/h" in junit(run).decode()
    message = of_run(run, now())
    assert message is not None
    assert f"a: {FLICKER} unbounded (inconclusive)" in message.text
