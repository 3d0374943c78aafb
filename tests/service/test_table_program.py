"""Table programs through REST: the thesis's macro runs dwell by dwell; other lines are refused by number."""

from typing import Any

import numpy as np
import pytest

from tests.kit.forward_model import B_ACCELEROMETER, K_ACCELEROMETER, turn
from tests.kit.table_programs import APPENDIX, HOME
from tests.service.client import Client

G = 9.810553
SHORT = HOME + ":demand:position 2,90\ndelay 12\n"


@pytest.fixture(scope="module")
def job(sqlite_client: Client) -> dict[str, Any]:
    submitted = sqlite_client.submit("table_program", parameters={"program": APPENDIX}, seed=3)
    return sqlite_client.wait(submitted["id"], seconds=100.0)


def test_the_appendix_gives_one_recording_a_dwell(sqlite_client: Client, job: dict[str, Any]) -> None:
    assert job["state"] == "succeeded", job
    recordings = sqlite_client.recordings(job["id"])[::-1]
    stored = sqlite_client.http.get(f"/api/v1/jobs/{job['id']}/result").json()
    dwells = stored["document"]["dwells"]
    assert len(recordings) == len(dwells) == 16
    assert stored["verdict"] == "pass"
    for recording, dwell in zip(recordings, dwells, strict=True):
        assert recording["count"] == dwell["samples_recorded"] == dwell["samples_planned"]
        assert recording["station"]["label"] == dwell["label"]
        assert recording["count"] / 400.0 == pytest.approx(recording["station"]["record_s"])
    # A controller that goes on while the table moves takes the sum of its delays: 10 + 102 + 13·60 + 100 s. The
    # simulated servo moves more gently than the axes could, by at most 5 s a dwell.
    took = recordings[-1]["start_s"] + recordings[-1]["station"]["record_s"]
    assert 992.0 <= took < 992.0 + 16 * 5.0
    assert {r["launched_s"] for r in recordings} == {0.0}


def test_each_dwell_saw_gravity_as_the_table_stood(sqlite_client: Client, job: dict[str, Any]) -> None:
    """By rotation matrices written out; a launch may shift bias and scale, four standard deviations of each."""
    dwells = sqlite_client.http.get(f"/api/v1/jobs/{job['id']}/result").json()["document"]["dwells"]
    for d in dwells:
        attitude = turn("y", d["outer_deg"]) @ turn("z", d["middle_deg"]) @ turn("x", d["inner_deg"])
        expected = B_ACCELEROMETER + K_ACCELEROMETER @ attitude.T @ np.array([0.0, G, 0.0])
        means = {m["channel"]: m for m in d["means"]}
        found = np.array([means[f"accelerometer_{axis}"]["mean"] for axis in "xyz"])
        # 5.3e-5 m/s² and 80 ppm of g a launch; 10 arcsec of the table
        assert np.abs(found - expected).max() < 4 * (5.3e-5 + 80e-6 * G + 10.0 / 206_265 * G)
        assert all(m["standard_uncertainty"] > 0 for m in d["means"])


def test_the_page_shows_the_means(sqlite_client: Client, job: dict[str, Any]) -> None:
    result = sqlite_client.http.get(f"/api/v1/jobs/{job['id']}/result").json()
    page = sqlite_client.http.get(result["page"]).text
    for text in ("Mean outputs", "Standard uncertainties of the means", "outer=-189 middle=90 inner=135"):
        assert text in page


def test_what_a_program_is_written_as_can_be_sent_back(sqlite_client: Client) -> None:
    positions = [[10.0, 20.5, -30.0, 12.0], [0.0, 0.0, 0.0, 12.0]]
    written = sqlite_client.preview("table_program", positions=positions).json()
    program = written["parameters"]["program"]
    assert ":demand:position 1,-30; p 2,20.5; p 3,10" in program
    again = sqlite_client.preview("table_program", program=program).json()
    assert again["stations"] == written["stations"]
    assert written["duration_s"] == pytest.approx(24.0, abs=0.2)
    assert len(written["predicted_uncertainties"]) == 6


@pytest.mark.parametrize("where", ["preview", "job"])
def test_a_line_outside_the_dialect_is_answered_with_its_number(sqlite_client: Client, where: str) -> None:
    parameters = {"program": SHORT + ":demand:rate 1,10\n"}
    if where == "preview":
        answer = sqlite_client.preview("table_program", **parameters)
    else:
        body = {"procedure": "table_program", "unit": "SIM-0001", "parameters": parameters}
        answer = sqlite_client.http.post("/api/v1/jobs", json=body)
    assert answer.status_code == 422
    (error,) = answer.json()["errors"]
    assert error["field"] == "program"
    assert error["value"] == ":demand:rate 1,10"
    assert error["message"].startswith("line 5: expected a comment (%), ':mode:position all'")


def test_a_position_beyond_an_axis_is_told_with_its_line_and_refused(sqlite_client: Client) -> None:
    program = SHORT + ":demand:position 2,200\ndelay 20\n"
    preview = sqlite_client.preview("table_program", program=program).json()
    (violation,) = preview["violations"]
    assert "line 6" in violation
    assert "middle_deg = 200 is outside -190 … 190" in violation
    before = sqlite_client.stored()
    body = {"procedure": "table_program", "unit": "SIM-0001", "parameters": {"program": program}}
    answer = sqlite_client.http.post("/api/v1/jobs", json=body)
    assert answer.status_code == 422
    assert "line 6" in answer.text
    assert sqlite_client.stored() == before


@pytest.mark.parametrize(
    ("parameters", "text"),
    [
        ({"program": "x" * 50_001}, "50000"),
        ({"positions": []}, "positions"),
        ({"positions": [[0, 0, 0, 0]]}, "positions"),
        ({"program": SHORT, "delay_from": "now"}, "delay_from"),
        ({"program": HOME + "delay 2\n"}, "line 3: expected a delay of at least 3 s"),
    ],
)
def test_refusals(sqlite_client: Client, parameters: dict[str, Any], text: str) -> None:
    answer = sqlite_client.preview("table_program", **parameters)
    assert answer.status_code == 422
    assert text in answer.text
