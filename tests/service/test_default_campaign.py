"""The campaign that ships, scaled down, from one request to JUnit XML; and a golden unit's history."""

import math
from typing import Any
from xml.etree import ElementTree

import pytest

from bench_service.campaigns.shipped import shipped
from bench_service.drivers.simulated import SimulatedDriver
from procedures import catalog
from procedures.procedure import Context
from tests.service.campaigns import SCALED_DOWN, SHORT, add, ended, named, start
from tests.service.client import Client
from tests.service.junit_readers import assert_readable

pytestmark = pytest.mark.timeout(320)

LAUNCHES = [f"{name}_{number}" for number in (1, 2, 3) for name in ("calibration", "verification")]
STEPS = ["static", "converter", "thermal", *LAUNCHES, "run_to_run"]


@pytest.fixture(scope="module")
def run(sqlite_client: Client) -> dict[str, Any]:
    run_id = start(sqlite_client, "thesis_acceptance", seed=5, parameters=SCALED_DOWN)["id"]
    return ended(sqlite_client, run_id, 300.0)


@pytest.fixture(scope="module")
def report(sqlite_client: Client, run: dict[str, Any]) -> dict[str, Any]:
    return sqlite_client.http.get(f"/api/v1/campaign-runs/{run['id']}/report").json()


def test_it_is_the_theses_campaign(sqlite_client: Client) -> None:
    campaign = shipped()["thesis_acceptance"]
    static = campaign.step("static").parameters
    assert (static["launches"], static["duration_s"], static["sample_rate_hz"]) == (4, 6 * 3600.0, 100.0)
    limits = campaign.step("run_to_run").parameters
    assert limits["gyro_scale_run_to_run_ppm"] == 10.0  # thesis 4.3, 5.6
    assert limits["accelerometer_bias_run_to_run_m_s2"] == 0.0005
    answer = sqlite_client.http.post("/api/v1/campaigns/thesis_acceptance/preview", json={"unit": "SIM-0001"}).json()
    hours = {step["name"]: step["duration_s"] / 3600.0 for step in answer["steps"]}
    assert hours["static"] == pytest.approx(4 * 7.0, abs=0.01)
    assert hours["calibration_1"] == pytest.approx(12 * 115.0 / 3600.0, abs=0.01), "dwells of 110 s, see below"
    assert any("10 ppm cannot be resolved" in warning for warning in answer["warnings"])


def test_the_preview_knows_the_averaging_time_that_the_static_run_is_to_find(sqlite_client: Client) -> None:
    """The longest crossing of the record's noise, gyro z's: ``fB²τ² + N²τ = 3Q²``, f = 2 ln 2/π, in steps of 5 s; the
    record has 70 s. A calibration alone, or one with a dwell of its own, is planned as it would be without the run.
    """
    unit = SimulatedDriver("sim").mounted()[0]
    assert unit.gyro is not None
    z = unit.gyro.noise[2]
    f, n2 = 2.0 * math.log(2.0) / math.pi * z.bias_instability**2, z.random_walk**2
    tau = (math.sqrt(n2**2 + 12.0 * f * z.quantization**2) - n2) / (2.0 * f)
    dwell = 5.0 * math.ceil(tau / 5.0)
    assert (dwell, unit.averaging_time_s) == (110.0, 70.0)
    static, calibration = {"procedure": "static_run"}, {"procedure": "calibration_12_orientations"}
    add(sqlite_client, named("dwells", static, calibration, {**calibration, "parameters": {"dwell_s": 70.0}}))
    add(sqlite_client, named("no_static", calibration))
    foreseen = {
        name: sqlite_client.http.post(f"/api/v1/campaigns/{name}/preview", json={"unit": "SIM-0001"}).json()["steps"]
        for name in ("dwells", "no_static")
    }
    (_, after, given), (alone,) = foreseen["dwells"], foreseen["no_static"]
    assert after["duration_s"] - alone["duration_s"] == pytest.approx(12 * (dwell - 70.0))
    assert given["duration_s"] == alone["duration_s"]
    sentence = "predicted with the averaging time of 110 s that step a is expected to find"
    assert [any(sentence in w for w in step["warnings"]) for step in (after, given, alone)] == [True, False, False]
    noise = [[c["standard_uncertainty"] for c in s["limits"] if "bias in run" in c["check"]] for s in (after, alone)]
    assert noise[0][0] < noise[1][0], "longer dwells scatter less"


def test_every_step_says_what_became_of_it(run: dict[str, Any]) -> None:
    assert [step["name"] for step in run["steps"]] == STEPS
    assert run["state"] == "succeeded", run["reason"]
    states = {step["name"]: step["state"] for step in run["steps"]}
    assert set(states.values()) == {"succeeded"}
    verdicts = [step["verdict"] for step in run["steps"] if step["verdict"]]
    assert run["verdict"] == "fail"
    assert verdicts == ["pass"] * (len(STEPS) - 1) + ["fail"]
    missed = [check["name"] for check in run["steps"][-1]["checks"] if not check["passed"]]
    assert {f"gyro scale factor {axis} run to run" for axis in "xyz"} <= set(missed), "10 ppm from the Earth's rate"
    assert any("gyro scale factor x: the limit cannot be resolved" in w for w in run["steps"][-1]["warnings"])
    calibrations = [step for step in run["steps"] if step["name"].startswith("calibration")]
    assert [step["seed"] for step in calibrations] == [8, 10, 12]  # the run's base and the number of the step


def test_a_result_has_what_its_procedure_promised(sqlite_client: Client, run: dict[str, Any]) -> None:
    """Limits are refused by these names before a campaign runs, so they must be the names that come out."""
    service = sqlite_client.http
    unit_and_bench = (SimulatedDriver("sim").mounted()[0], SimulatedDriver("sim").description)
    for step in run["steps"]:
        procedure = catalog.discover().get(step["does"])
        if procedure is None or step["job"] is None:
            continue
        job = service.get(f"/api/v1/jobs/{step['job']}").json()
        context, params = Context(*unit_and_bench), procedure.params.model_validate(job["parameters"])
        found = {check["name"] for check in step["checks"]}
        needs = procedure.uses_calibration or job["parameters"].get("thermal_correction") == "current"
        if not needs:  # the unit of this context has neither
            assert {one.check for one in procedure.planned_checks(params, context)} <= found, step["name"]
        if procedure.quantities is None:
            continue
        promised = procedure.quantities(params, context)
        assert found == {name for name in promised if name in found}
        missing = [name for name in promised if name not in found and ".K" not in name and ".b_" not in name]
        assert missing == [], step["name"]


def test_the_report_leads_back_to_the_samples(
    sqlite_client: Client, run: dict[str, Any], report: dict[str, Any]
) -> None:
    assert report["run"] == run
    jobs = {one["step"]: one for one in report["lineage"]}
    assert set(jobs) == {step["name"] for step in run["steps"] if step["state"] == "succeeded"}
    static = jobs["static"]
    ((recording, digest),) = static["recordings"]
    stored = sqlite_client.http.get(f"/api/v1/recordings/{recording}").json()
    assert (stored["content_hash"], stored["job"], stored["rate_hz"]) == (digest, static["job"], 100.0)
    assert stored["count"] == 600 * 100
    assert static["simulated"] is True
    assert static["seed"] == 5
    assert report["code_versions"] == [sqlite_client.http.get("/healthz").json()["code_version"]]
    results = [jobs[f"calibration_{k}"]["result"] for k in (1, 2, 3)]
    made = sqlite_client.http.get("/api/v1/units/SIM-0001/calibrations", params={"limit": 500}).json()["items"]
    of_result = {r: [c["id"] for c in reversed(made) if c["result"] == r] for r in results}
    assert jobs["run_to_run"]["calibrations"] == [c for r in results for c in of_result[r]]


def test_the_junit_document_is_what_ci_systems_read(sqlite_client: Client, run: dict[str, Any]) -> None:
    answer = sqlite_client.http.get(f"/api/v1/campaign-runs/{run['id']}/report", params={"format": "junit"})
    assert answer.headers["content-type"] == "application/xml"
    assert_readable(answer.content)
    root = ElementTree.fromstring(answer.content)
    assert (root.tag, root.get("name")) == ("testsuites", "thesis_acceptance SIM-0001")
    suites = root.findall("testsuite")
    assert [suite.get("name") for suite in suites] == STEPS
    for suite, step in zip(suites, run["steps"], strict=True):
        assert [child.tag for child in suite] == ["properties"] + ["testcase"] * len(suite.findall("testcase"))
        cases = suite.findall("testcase")
        names = [case.get("name") for case in cases]
        assert names == ([c["name"] for c in step["checks"]] or [step["name"]])
        failed = [case.get("name") for case in cases if case.find("failure") is not None]
        assert failed == [c["name"] for c in step["checks"] if not c["passed"]]
        skipped = [case for case in cases if case.find("skipped") is not None]
        assert len(skipped) == (1 if step["state"] == "skipped" else 0)
        told = {"tests": len(cases), "failures": len(failed), "errors": 0, "skipped": len(skipped)}
        assert {name: int(suite.get(name) or 0) for name in told} == told
        assert all(len(case) <= 1 and case.get("classname") and case.get("time") for case in cases)
        properties = {p.get("name"): p.get("value") for p in suite.iter("property")}
        assert properties["campaign_run"] == run["id"]
        assert properties.get("job") == step["job"]


def test_a_unit_that_is_not_fit_goes_no_further(sqlite_client: Client) -> None:
    """The gates close behind a static run that fails, each with the check that failed, and nothing else moves."""
    static = {**SCALED_DOWN["static"], "noise_limits": {"gyro_random_walk_deg_sqrt_h": 1e-6}}
    run_id = start(sqlite_client, "acceptance", seed=5, parameters={**SCALED_DOWN, "static": static})["id"]
    run = ended(sqlite_client, run_id)
    assert (run["state"], run["verdict"]) == ("succeeded", "fail")
    polarity, first, *others = run["steps"]
    assert (polarity["name"], polarity["verdict"]) == ("polarity", "pass")
    assert (first["verdict"], {step["state"] for step in others}) == ("fail", {"skipped"})
    assert {step["job"] for step in others} == {None}
    assert others[0]["reason"].startswith("gate: static failed (gyro_x random walk = ")
    assert "limit ≤ 1e-06 deg/√h" in others[0]["reason"]
    assert "thermal was left out" in next(s["reason"] for s in others if s["name"] == "scale_1")


def test_the_preview_tells_what_each_limit_is_worth(sqlite_client: Client) -> None:
    """The two campaigns differ where the thesis's limits are beyond its plan, and the preview says so beforehand."""
    found: dict[str, Any] = {}
    for name in ("thesis_acceptance", "acceptance"):
        address = f"/api/v1/campaigns/{name}/preview"
        found[name] = sqlite_client.http.post(address, json={"unit": "RANDOM-41"}).json()
    assert found["acceptance"]["decision"].startswith("simple acceptance")
    limits = {n: {(s["name"], c["check"]): c for s in f["steps"] for c in s["limits"]} for n, f in found.items()}
    every = [c for name in limits for c in limits[name].values()]
    assert all(c["source"] for c in every)
    scale = "gyro scale factor x run to run"
    coarse = limits["thesis_acceptance"]["run_to_run", scale]
    fine = limits["acceptance"]["scale_run_to_run", scale]
    assert (coarse["resolved"], fine["resolved"]) == (False, True)
    assert fine["maximum"] == coarse["maximum"] == 10.0
    # Two degrees of freedom, twice the limit: exp(-1/4) where the measurement adds nothing.
    assert fine["power_at_twice"] == pytest.approx(math.exp(-0.25), abs=0.002)
    gates = {s["name"]: s["gates"] for s in found["acceptance"]["steps"]}
    assert gates["calibration_2"] == ["scale_2: pass"]


def test_limits_and_history_of_a_golden_unit(sqlite_client: Client) -> None:
    step = {
        "procedure": "calibration_12_orientations",
        "parameters": {**SHORT, "limits": {"gyro_bias_in_run_deg_h": 1.0}},
        "limits": [{"quantity": "gyro.b_x", "unit": "deg/h", "minimum": -100.0, "maximum": 100.0, "source": "a test"}],
        "trends": [{"quantity": "gyro.b_x", "at_least": 2, "outcome": "fail"}],
    }
    add(sqlite_client, named("golden", step, seeds={"rule": "repeat", "base": 9}))
    runs = [ended(sqlite_client, start(sqlite_client, "golden", unit="RANDOM-3")["id"]) for _ in range(2)]
    assert [run["verdict"] for run in runs] == ["pass"] * 2
    names = [c["name"] for c in runs[-1]["steps"][0]["checks"]]
    assert names[-1] == "gyro.b_x, campaign's limit"
    assert "trend of gyro.b_x: 1 earlier results, 2 are needed to judge it" in runs[-1]["steps"][0]["warnings"]
    query = {"quantity": "gyro.b_x", "procedure": "calibration_12_orientations"}
    trend = sqlite_client.http.get("/api/v1/units/RANDOM-3/trend", params=query).json()
    values = [p["value"] for p in trend["points"]]
    assert values == [values[0]] * 2  # the same night twice
    assert trend["limits"]["sigma"] == 0.0
    assert sqlite_client.http.get("/units/RANDOM-3/trend", params=query).status_code == 200
    other = ended(sqlite_client, start(sqlite_client, "golden", unit="RANDOM-3", seed=10)["id"])
    assert other["verdict"] == "fail"  # a spread of zero notices every other night
    assert [c["name"] for c in other["steps"][0]["checks"] if not c["passed"]] == ["gyro.b_x, trend"]
