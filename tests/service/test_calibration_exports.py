"""Exports of calibrations through REST and the command line's request."""

import json

import numpy as np
import pytest

from tests.service.client import Client
from tests.service.entries import PATH, enter

BACKENDS = ("sqlite",)
"""Forms of files that other programs read; `tests/storage/test_calibration_exports.py` has what the database gives."""


@pytest.fixture(scope="module")
def client(sqlite_client: Client) -> Client:
    """The storage's own tests show that the databases do not differ here."""
    return sqlite_client


def export(client: Client, one: dict, form: str, **more: str) -> str:
    answer = client.http.get(f"{PATH}/{one['id']}/export", params={"format": form, **more})
    assert answer.status_code == 200, answer.text
    assert answer.headers["Content-Disposition"].startswith('attachment; filename="SIM-0001-')
    return answer.text


def test_a_calibration_goes_out_with_the_other_triads(client: Client) -> None:
    gyro, accelerometer = enter(client, "gyro"), enter(client, "accelerometer")
    document = json.loads(export(client, gyro, "json"))
    assert [t["calibration"] for t in document["triads"]] == [gyro["id"]]  # the other one was not measured with it
    assert document["triads"][0]["forward"]["b"] == gyro["calibration"]["bias"]
    assert document["triads"][0]["origin"] == "passport 17"
    both = json.loads(export(client, gyro, "json", other=accelerometer["id"]))
    assert [t["triad"] for t in both["triads"]] == ["gyro", "accelerometer"]
    assert np.allclose(np.array(both["triads"][1]["inverse"]["A"]) @ both["triads"][1]["forward"]["K"], np.eye(3))
    assert accelerometer["id"] in export(client, gyro, "matlab", other=accelerometer["id"])
    unseen = client.http.get(f"{PATH}/{gyro['id']}/export", params={"format": "openvins", "other": accelerometer["id"]})
    assert unseen.status_code == 422  # the default unit's accelerometers show no random walk (thesis table 4.2)
    assert "that of the accelerometers is 0; declare a bound" in unseen.json()["detail"]


def test_a_current_calibration_is_added_and_a_rejected_one_is_not(client: Client) -> None:
    gyro, accelerometer = enter(client, "gyro"), enter(client, "accelerometer", choose=True)
    assert f"calibration {accelerometer['id']} was added" in export(client, gyro, "ardupilot")
    client.http.post(f"{PATH}/{accelerometer['id']}/reject", json={"remark": "dropped"})
    refusal = client.http.get(f"{PATH}/{gyro['id']}/export", params={"format": "ardupilot"})
    assert (refusal.status_code, refusal.json()["errors"][0]["field"]) == (422, "format")
    assert "give its calibration as `other`" in refusal.text
    assert "NOT FOR USE" in export(client, gyro, "ardupilot", other=accelerometer["id"])


def test_bad_requests_are_refused_in_words(client: Client) -> None:
    gyro = enter(client, "gyro")
    for query, status, says in (
        ({"format": "excel"}, 422, "openvins"),
        ({"format": "json", "other": gyro["id"]}, 422, "both are of the gyros"),
        ({"format": "json", "other": "none"}, 404, "no calibration"),
    ):
        answer = client.http.get(f"{PATH}/{gyro['id']}/export", params=query)
        assert answer.status_code == status, answer.text
        assert says in answer.text
    assert client.http.get(f"/api/v1/units/NONE/calibrations/{gyro['id']}/export").status_code == 404


def test_a_measured_calibration_brings_both_triads_and_its_recordings(client: Client) -> None:
    made = client.calibrate(seed=31)
    document = json.loads(export(client, {"id": made["gyro"]}, "json"))
    assert [t["calibration"] for t in document["triads"]] == list(made.values())
    recordings = document["triads"][0]["lineage"]["recordings"]
    assert len(recordings) == 12
    assert all(len(r["content_hash"]) == 64 for r in recordings)
    assert "SIMULATED" in export(client, {"id": made["gyro"]}, "c")
