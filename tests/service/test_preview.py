"""Preview of a plan before anything moves, and what several calibrations of one unit say together."""

from math import sqrt

import httpx
import pytest

from tests.service.client import Client
from tests.service.page import drawn

CALIBRATION = "calibration_12_orientations"


def uncertainties(answer: httpx.Response) -> dict[str, float]:
    return {u["name"]: u["standard_uncertainty"] for u in answer.json()["predicted_uncertainties"]}


def test_the_default_calibration_is_laid_out_in_full_and_nothing_moves(sqlite_client: Client) -> None:
    before = sqlite_client.stored()
    answer = sqlite_client.preview()
    assert answer.status_code == 200, answer.text
    plan = answer.json()
    assert [s["index"] for s in plan["stations"]] == list(range(12))
    assert {s["record_s"] for s in plan["stations"]} == {70.0}
    assert plan["parameters"]["dwell_s"] == 70.0
    assert 12 * 72 < plan["duration_s"] < 12 * 72 + 12 * 10
    assert plan["data_bytes"] == 12 * 70 * 400 * 6 * 2
    assert plan["violations"] == []
    assert sqlite_client.stored() == before
    assert sqlite_client.http.get("/api/v1/benches/sim").json()["state"] == "idle"


def test_every_coefficient_has_a_predicted_uncertainty_of_noise_and_of_the_table(sqlite_client: Client) -> None:
    predicted = sqlite_client.preview().json()["predicted_uncertainties"]
    assert len(predicted) == len({p["name"] for p in predicted}) == 24
    names = {f"{triad}.{c}" for triad in ("gyro", "accelerometer") for c in ("b_x", "b_y", "b_z", "K11", "K23", "K33")}
    assert names <= {p["name"] for p in predicted}
    units = {p["name"]: p["unit"] for p in predicted}
    assert (units["gyro.b_x"], units["accelerometer.b_x"], units["gyro.K11"]) == ("rad/s", "m/s^2", "1")
    for p in predicted:
        whole = sqrt(p["from_noise"] ** 2 + p["from_table"] ** 2)
        assert p["standard_uncertainty"] == pytest.approx(whole, rel=1e-9)
        assert p["from_noise"] > 0


def test_a_limit_that_the_plan_cannot_resolve_is_warned_of_with_its_figure(sqlite_client: Client) -> None:
    answer = sqlite_client.preview()
    (warning,) = [w for w in answer.json()["warnings"] if w.startswith("gyro scale factor run to run")]
    assert "limit of 10 ppm cannot be resolved" in warning
    figure = float(warning.split("standard uncertainty is ")[1].split(" ppm")[0])
    assert 300 < figure < 900
    predicted = uncertainties(answer)
    assert figure == pytest.approx(1e6 * max(predicted[f"gyro.K{i}{i}"] for i in (1, 2, 3)), rel=0.05)
    wide = sqlite_client.preview(limits={"gyro_scale_run_to_run_ppm": 5000.0}).json()["warnings"]
    assert not any(w.startswith("gyro scale factor") for w in wide)


def test_a_longer_dwell_promises_smaller_uncertainties_and_costs_what_it_says(sqlite_client: Client) -> None:
    short, default, long = (sqlite_client.preview(**p) for p in ({"dwell_s": 20.0}, {}, {"dwell_s": 700.0}))
    of = [uncertainties(answer) for answer in (short, default, long)]
    for name in (n for n in of[0] if n.startswith("gyro")):  # accelerometers are at the floor of their flicker noise
        assert of[0][name] > of[1][name] > of[2][name]
    assert of[0]["gyro.K11"] / of[2]["gyro.K11"] > 3
    seconds = [answer.json()["duration_s"] for answer in (short, default, long)]
    assert seconds[1] - seconds[0] == pytest.approx(12 * 50.0)
    assert seconds[2] - seconds[1] == pytest.approx(12 * 630.0)
    assert long.json()["data_bytes"] == 10 * default.json()["data_bytes"]


def test_the_preview_is_the_plan_of_the_job(sqlite_client: Client) -> None:
    preview = sqlite_client.preview(dwell_s=5.0, settle_s=0.5).json()
    job = sqlite_client.wait(sqlite_client.submit(seed=31)["id"])
    assert job["parameters"] == preview["parameters"]
    assert job["duration_s"] == preview["duration_s"]
    stations = sorted((r["station"] for r in sqlite_client.recordings(job["id"])), key=lambda s: s["index"])
    assert stations == preview["stations"]
    assert sum(r["stored_bytes"] for r in sqlite_client.recordings(job["id"])) <= preview["data_bytes"]


def test_a_verification_can_be_previewed_once_there_is_a_calibration(sqlite_client: Client) -> None:
    sqlite_client.calibrate(seed=32)
    plan = sqlite_client.preview("verification_9_orientations").json()
    assert len(plan["stations"]) == 9
    assert {u["name"] for u in plan["predicted_uncertainties"]} >= {
        "gyro.sd after correction",
        "accelerometer.sd after correction",
    }


def test_launches_are_compared_and_what_the_calibrations_cannot_resolve_is_said(sqlite_client: Client) -> None:
    for seed in (41, 42, 43):
        assert sqlite_client.wait(sqlite_client.submit(parameters={}, seed=seed)["id"])["state"] == "succeeded"
    items = sqlite_client.http.get("/api/v1/units/SIM-0001/calibrations", params={"limit": 6}).json()["items"]
    ids = [c["id"] for c in items]
    answer = sqlite_client.analyse("run_to_run", calibrations=ids)
    assert answer.status_code == 201, answer.text
    result = answer.json()
    assert result["lineage"]["calibrations"] == ids
    scatters = {(s["triad"], s["name"]): s for s in result["document"]["scatters"]}
    kinds = [f"{kind} {axis}" for kind in ("bias", "scale factor") for axis in "xyz"]
    assert set(scatters) == {(triad, kind) for triad in ("gyro", "accelerometer") for kind in kinds}
    for s in scatters.values():
        assert 0 < s["low"] < s["sd"] < s["high"]
        assert len(s["values"]) == len(s["value_sds"]) == 3
    unresolved = [w for w in result["document"]["warnings"] if w.startswith("gyro scale factor")]
    assert len(unresolved) == 3
    assert all("cannot be resolved" in w for w in unresolved)
    notes = {c["name"]: c["note"] for c in result["document"]["checks"]}
    assert notes["gyro scale factor x run to run"] == "beneath the uncertainty of the calibrations: not resolved"
    assert notes["accelerometer bias x run to run"] == ""
    assert drawn(sqlite_client, sqlite_client.http.get(result["page"]).text) == 12


def test_a_comparison_of_simulated_calibrations_is_itself_simulated(sqlite_client: Client) -> None:
    for seed in (51, 52):
        sqlite_client.wait(sqlite_client.submit(seed=seed)["id"])
    items = sqlite_client.http.get("/api/v1/units/SIM-0001/calibrations", params={"limit": 4}).json()["items"]
    assert all(c["simulated"] for c in items)
    result = sqlite_client.analyse("run_to_run", calibrations=[c["id"] for c in items]).json()
    assert result["lineage"]["simulated"] is True


def test_one_calibration_is_not_a_comparison(sqlite_client: Client) -> None:
    newest = sqlite_client.calibrate(seed=61)["gyro"]
    answer = sqlite_client.analyse("run_to_run", calibrations=[newest])
    assert answer.status_code == 422
    assert "at least two" in answer.json()["detail"]
