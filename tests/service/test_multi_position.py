"""Calibration in any positions over REST: the thesis's program from moves to coefficients, and the same by method."""

import math

import httpx
import numpy as np
import pytest

from procedures.core.frames import specific_force_b
from procedures.core.site import Site
from procedures.core.table_angles import TableAngles
from tests.service.campaigns import add, named
from tests.service.client import Client


@pytest.fixture(scope="module")
def job(sqlite_client: Client) -> dict:
    body = {
        "procedure": "multi_position_calibration",
        "parameters": {"dwell_s": 10.0, "weighting": "noise", "residual_p_value_min": 0.0005},
        "seed": 11,
    }
    done = sqlite_client.wait(sqlite_client.submit(**body)["id"])
    assert done["state"] == "succeeded", done
    return done


def document(client: Client, job: dict) -> dict:
    return client.http.get(f"/api/v1/jobs/{job['id']}/result").json()["document"]


def test_the_thesis_program_gives_fourteen_recordings_and_both_triads(sqlite_client: Client, job: dict) -> None:
    found = document(sqlite_client, job)
    assert len(sqlite_client.recordings(job["id"])) == 14
    assert [t["calibration"]["triad"] for t in found["triads"]] == ["gyro", "accelerometer"]
    for triad in found["triads"]:
        assert len(triad["coefficients"]) == 12
        assert triad["condition"] < 1.5
        assert all(math.isfinite(c["standard_uncertainty"]) for c in triad["coefficients"])
    assert job["verdict"] == "pass", found["checks"]


def test_each_limit_names_its_source(sqlite_client: Client, job: dict) -> None:
    sources = {c["name"]: c["limit"]["source"] for c in document(sqlite_client, job)["checks"]}
    assert sources["gyro residuals, p-value of chi-square"] == "the request"
    assert sources["gyro condition number"] == "ours"
    assert "" not in sources.values()
    step = {"procedure": "multi_position_calibration", "parameters": {"dwell_s": 10.0, "residual_p_value_min": 0.0005}}
    add(sqlite_client, named("positions", step))
    foreseen = sqlite_client.http.post("/api/v1/campaigns/positions/preview", json={"unit": "SIM-0001"}).json()
    planned = {limit["check"]: limit["source"] for limit in foreseen["steps"][0]["limits"]}
    assert len(planned) == 4
    assert planned == {name: sources[name] for name in planned}


def test_the_method_gives_the_procedures_numbers_from_its_recordings(sqlite_client: Client, job: dict) -> None:
    recordings = sorted(sqlite_client.recordings(job["id"]), key=lambda r: r["station"]["index"])
    parameters = {"gravity_m_s2": 9.810553, "latitude_deg": 50.45, "weighting": "noise"}  # of the simulated bench
    ids = [r["id"] for r in recordings]
    answer = sqlite_client.analyse("multi_position_calibration_of_recordings", recordings=ids, parameters=parameters)
    assert answer.status_code == 201, answer.text
    ours, theirs = answer.json()["document"], document(sqlite_client, job)
    for one, other in zip(ours["triads"], theirs["triads"], strict=True):
        np.testing.assert_allclose(
            [c["estimate"] for c in one["coefficients"]],
            [c["estimate"] for c in other["coefficients"]],
            rtol=1e-9,
            atol=1e-15,
        )
    assert sqlite_client.http.get(answer.json()["page"]).status_code == 200


def test_directions_alone_calibrate_the_accelerometers(sqlite_client: Client, job: dict) -> None:
    recordings = sorted(sqlite_client.recordings(job["id"]), key=lambda r: r["station"]["index"])
    found = document(sqlite_client, job)
    accelerometer = next(t for t in found["triads"] if t["calibration"]["triad"] == "accelerometer")
    k = np.array(accelerometer["calibration"]["matrix"])
    bias = np.array(accelerometer["calibration"]["bias"])
    site = Site(0.0, 9.81)
    stations = [r["station"]["angles"] for r in recordings]
    angles = [TableAngles(a["outer_deg"], a["middle_deg"], a["inner_deg"]) for a in stations]
    parameters = {
        "triads": ["accelerometer"],
        "gravity_m_s2": 9.810553,
        "directions": specific_force_b(angles, site).tolist(),
        "direction_sd_arcsec": 5.0,
        "terms": ["quadratic"],
    }
    answer = sqlite_client.analyse(
        "multi_position_calibration_of_recordings", recordings=[r["id"] for r in recordings], parameters=parameters
    )
    assert answer.status_code == 201, answer.text
    (extended,) = answer.json()["document"]["extended"]
    np.testing.assert_allclose(extended["calibration"]["matrix"], k, atol=2e-4)
    np.testing.assert_allclose(extended["calibration"]["bias"], bias, atol=2e-3)
    assert [t["name"] for t in extended["terms"]] == ["K2_x", "K2_y", "K2_z"]


@pytest.mark.parametrize(
    ("parameters", "field", "sentence"),
    [
        ({"positions": [[0, 0, 0]]}, "positions", "one for each of the 14 recordings"),
        ({"directions": [[0, 1, 0]] * 14}, "triads", "does not show where north is"),
        ({"directions": [[0, 0, 0]] * 14, "triads": ["accelerometer"]}, "directions[0]", "not zero"),
        ({"directions": [[0, 1, 0]] * 14, "positions": [[0, 0, 0]] * 14}, "directions", "one of the two"),
        ({"latitude_deg": None}, "latitude_deg", "by the Earth's rate"),
    ],
)
def test_bad_input_names_the_field_and_the_way_out(
    sqlite_client: Client, job: dict, parameters: dict, field: str, sentence: str
) -> None:
    ids = [r["id"] for r in sqlite_client.recordings(job["id"])]
    body = {"gravity_m_s2": 9.81, "latitude_deg": 50.0, **parameters}
    answer = sqlite_client.analyse("multi_position_calibration_of_recordings", recordings=ids, parameters=body)
    assert answer.status_code == 422, answer.text
    assert field in answer.text
    assert sentence in answer.text


def preview(client: Client, **parameters: object) -> httpx.Response:
    body = {"unit": "SIM-0001", "parameters": parameters}
    return client.http.post("/api/v1/procedures/multi_position_calibration/preview", json=body)


def test_a_set_that_is_deficient_is_refused_before_anything_moves(sqlite_client: Client) -> None:
    about_x = [[0, 0, 0], [0, 0, 90], [0, 0, 180], [0, 0, 270]]
    refused = preview(sqlite_client, positions=about_x, terms=["quadratic"])
    assert refused.status_code == 422
    assert "each axis must be seen at three different inputs at least" in refused.json()["detail"]
    program = ":mode:position all\n:demand:position 1,0; p 2,0; p 3,0\ndelay\n"
    assert "line 3" in preview(sqlite_client, program=program).json()["detail"]


def test_a_program_is_calibrated_with_its_own_delays(sqlite_client: Client) -> None:
    lines = [":mode:position all"]
    for outer, middle, inner in (
        (0, 0, 0),
        (0, 0, 90),
        (0, 0, 180),
        (0, 90, 0),
        (0, -90, 0),
        (90, 0, -90),
        (90, 45, 30),
    ):
        lines += [f":demand:position 1,{inner}; p 2,{middle}; p 3,{outer}", "delay 7"]
    found = preview(sqlite_client, program="\n".join(lines)).json()
    assert not found["violations"]
    assert [s["record_s"] for s in found["stations"]] == [7.0] * 7
    assert {u["name"] for u in found["predicted_uncertainties"]} >= {"gyro.K11", "accelerometer.b_z"}
