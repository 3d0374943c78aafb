"""The Allan family through REST: a recording of a bench, a real one, and what is refused."""

import json
from pathlib import Path

import numpy as np
import pytest

from tests.service.client import FAST, Client
from tests.service.page import drawn


def test_the_curves_of_a_recording_agree_with_another_implementation(sqlite_client: Client) -> None:
    import allantools

    job = sqlite_client.wait(sqlite_client.submit(seed=4, parameters={**FAST, "dwell_s": 60.0})["id"])
    recording = sqlite_client.recordings(job["id"])[0]
    result = _deviation(sqlite_client, recording["id"], channels=["gyro_x"])
    (curve,) = result["document"]["curves"]
    text = sqlite_client.http.get(
        f"/api/v1/recordings/{recording['id']}/data", params={"format": "csv", "channels": "gyro_x"}
    ).text
    counts = np.array([float(line.split(",")[1]) for line in text.splitlines() if line[0].isdigit()])
    rates = counts * recording["channels"][0]["scale"] * recording["rate_hz"]
    wanted = np.array(curve["tau_s"]) * (1 + 1e-9)  # it cuts the cluster size to a whole number
    taus, expected, _, _ = allantools.oadev(rates, recording["rate_hz"], "freq", wanted)
    sizes = np.round(np.array(curve["tau_s"]) * recording["rate_hz"]).astype(int).tolist()
    ours = dict(zip(sizes, curve["deviation"], strict=True))
    theirs = dict(zip(np.round(taus * recording["rate_hz"]).astype(int).tolist(), expected, strict=True))
    assert len(ours) - len(theirs) <= 1  # it leaves out a time with a single term
    # Short recordings are taken exactly; both add some ten thousand squares in double precision.
    assert {m: ours[m] for m in theirs} == pytest.approx(theirs, rel=1e-9)
    assert all(low < d < high for low, d, high in zip(curve["lower"], curve["deviation"], curve["upper"], strict=True))
    page = sqlite_client.http.get(result["page"]).text
    assert drawn(sqlite_client, page) == 1


def test_a_real_recording_is_analysed_with_every_statistic(sqlite_client: Client, shared_data: Path) -> None:
    names = ("ax", "ay", "az", "gx", "gy", "gz")
    channels = [
        {"name": n, "quantity": "specific_force" if n[0] == "a" else "angular_rate", "unit": "count"} for n in names
    ]
    description = {"unit": "MPU-6050", "rate_hz": 100.0, "header_lines": 4, "channels": channels}
    file = shared_data / "mpu6050_static" / "static_449s.csv.gz"
    answer = sqlite_client.http.post(
        "/api/v1/recordings",
        files=[("files", (file.name, file.read_bytes(), "application/gzip"))],
        data={"description": json.dumps(description)},
    )
    assert answer.status_code == 201, answer.text
    for statistic in ("allan", "overlapping_allan", "modified_allan", "time", "hadamard", "overlapping_hadamard"):
        document = _deviation(sqlite_client, answer.json()["id"], statistic=statistic)["document"]
        assert [c["channel"] for c in document["curves"]] == list(names)
        assert all(d > 0 for c in document["curves"] for d in c["deviation"])


def test_a_channel_that_never_changes_and_a_recording_too_short_are_refused(sqlite_client: Client) -> None:
    channel = {"name": "gx", "quantity": "angular_rate", "unit": "count"}
    for rows, words in ((["7"] * 100, "channel gx: the channel is constant"), (["1", "2"] * 3, "samples")):
        answer = sqlite_client.http.post(
            "/api/v1/recordings",
            files=[("files", ("a.csv", "\n".join(["gx", *rows, ""]).encode(), "text/csv"))],
            data={"description": json.dumps({"unit": "SHORT", "rate_hz": 10.0, "channels": [channel]})},
        )
        body = {"method": "allan_deviation", "recordings": [answer.json()["id"]]}
        refusal = sqlite_client.http.post("/api/v1/analyses", json=body)
        assert refusal.status_code == 422
        assert words in refusal.json()["detail"]


def _deviation(client: Client, recording: str, **parameters: object) -> dict:
    body = {"method": "allan_deviation", "recordings": [recording], "parameters": parameters}
    answer = client.http.post("/api/v1/analyses", json=body)
    assert answer.status_code == 201, answer.text
    return answer.json()
