"""Samples of a recording in SI, corrected and decimated, and a whole job as one zip, through REST."""

import hashlib
import io
import json
import zipfile

import h5py
import numpy as np
import pandas as pd
import pytest

from procedures.core.imu_model import correct, triad_calibration
from tests.service.client import Client
from tests.service.entries import PATH, enter

BACKENDS = ("sqlite",)
"""Forms of samples; `tests/storage` has recordings on both databases."""

GYROS = ["gyro_x_rad_per_s", "gyro_y_rad_per_s", "gyro_z_rad_per_s"]


@pytest.fixture(scope="module")
def client(sqlite_client: Client) -> Client:
    """The storage's own tests show that the databases do not differ here."""
    return sqlite_client


@pytest.fixture(scope="module")
def job(client: Client) -> dict:
    return client.wait(client.submit(seed=4)["id"])


def samples(client: Client, recording: dict, **query: object) -> pd.DataFrame:
    answer = client.http.get(f"/api/v1/recordings/{recording['id']}/samples", params=query)
    assert answer.status_code == 200, answer.text
    return pd.read_csv(io.BytesIO(answer.content))


def test_physical_samples_are_the_scaled_raw_ones(client: Client, job: dict) -> None:
    recording = client.recordings(job["id"])[0]
    found, raw = samples(client, recording), samples(client, recording, values="raw")
    assert len(found) == len(raw) == recording["count"]
    gyro = next(c for c in recording["channels"] if c["name"] == "gyro_x")
    by_hand = (raw["gyro_x"] - gyro["offset"]) * gyro["scale"] * recording["rate_hz"]
    np.testing.assert_allclose(found["gyro_x_rad_per_s"], by_hand, rtol=1e-14)
    assert found["time_s"].iloc[1] == 1 / recording["rate_hz"]


def test_a_chosen_calibration_corrects_and_means_are_taken_after_it(client: Client, job: dict) -> None:
    one, recording = enter(client, "gyro"), client.recordings(job["id"])[0]
    values = np.column_stack([one["calibration"]["bias"], one["calibration"]["matrix"]]).ravel()
    calibration = triad_calibration("gyro", "rad/s", "rad/s", values, np.zeros((12, 12)))
    plain = samples(client, recording)
    found = samples(client, recording, corrected_by=one["id"], decimate=10)
    wanted = correct(plain[GYROS].to_numpy(), calibration)
    wanted = wanted[: len(found) * 10].reshape(-1, 10, 3).mean(axis=1)
    np.testing.assert_allclose(found[GYROS], wanted, rtol=0, atol=1e-15)
    client.http.post(f"{PATH}/{one['id']}/reject", json={"remark": "dropped"})
    for query, status, says in (
        ({"corrected_by": one["id"]}, 422, "not rejected"),
        ({"corrected_by": "none"}, 404, "calibration"),
        ({"values": "raw", "decimate": 5}, 422, "neither corrected nor decimated"),
        ({"format": "xls"}, 422, "parquet"),
        ({"decimate": 100_000}, 422, "has no more samples there"),
        ({"decimate": 100, "stop_s": 0.1}, 422, "1 … 40"),
    ):
        answer = client.http.get(f"/api/v1/recordings/{recording['id']}/samples", params=query)
        assert answer.status_code == status, answer.text
        assert says in answer.text


@pytest.mark.parametrize("form", ["csv", "h5"])
def test_a_whole_job_is_one_zip_whose_manifest_has_the_hashes(client: Client, job: dict, form: str) -> None:
    answer = client.http.get(f"/api/v1/jobs/{job['id']}/samples", params={"format": form, "decimate": 50})
    assert answer.status_code == 200, answer.text
    with zipfile.ZipFile(io.BytesIO(answer.content)) as archive:
        assert archive.testzip() is None
        manifest = json.loads(archive.read("manifest.json"))
        assert (manifest["job"], manifest["unit"], len(manifest["files"])) == (job["id"], "SIM-0001", 12)
        for one in manifest["files"]:
            content = archive.read(one["file"])
            assert (hashlib.sha256(content).hexdigest(), len(content)) == (one["sha256"], one["bytes"])
            assert one["units"]["accelerometer_x_m_per_s2"] == "m/s^2"
        stored = {r["content_hash"] for r in client.recordings(job["id"])}
        assert {f["recording_facts"]["content_hash_of_whole_recording"] for f in manifest["files"]} == stored


def test_a_job_without_recordings_and_an_unknown_job_are_refused(client: Client) -> None:
    assert client.http.get("/api/v1/jobs/none/samples").status_code == 404
    idle = client.wait(client.submit("no_operation")["id"])
    answer = client.http.get(f"/api/v1/jobs/{idle['id']}/samples")
    assert (answer.status_code, "no complete recording" in answer.text) == (404, True)


def test_names_of_files_tell_how_their_samples_were_treated(client: Client, job: dict) -> None:
    recording, one = client.recordings(job["id"])[0]["id"], enter(client, "gyro")
    for path, query, treated in (
        ("data", {"format": "npy"}, ""),
        ("data", {"format": "csv", "channels": "gyro_x"}, "-part"),
        ("samples", {"values": "raw"}, "-raw"),
        ("samples", {}, "-physical"),
        ("samples", {"corrected_by": one["id"], "decimate": 10}, "-physical-corrected-means10"),
        ("samples", {"stop_s": 1.0}, "-physical-part"),
    ):
        answer = client.http.get(f"/api/v1/recordings/{recording}/{path}", params=query)
        name = f"{recording}{treated}-simulated.{query.get('format', 'csv')}"
        assert answer.headers["Content-Disposition"] == f'attachment; filename="{name}"'


def test_a_raw_zip_says_counts_and_how_to_scale_them(client: Client, job: dict) -> None:
    query = {"format": "csv", "values": "raw"}
    answer = client.http.get(f"/api/v1/jobs/{job['id']}/samples", params=query)
    with zipfile.ZipFile(io.BytesIO(answer.content)) as archive:
        one = json.loads(archive.read("manifest.json"))["files"][0]
        assert one["file"].endswith("-raw-simulated.csv")
        raw = pd.read_csv(io.BytesIO(archive.read(one["file"])))
    assert (one["units"]["time_s"], one["units"]["gyro_x"]) == ("s", "count")
    said = next(c for c in one["columns"] if c["name"] == "gyro_x")
    assert (said["unit"], said["quantity"]) == ("rad", "angle_increment")
    recording = next(r for r in client.recordings(job["id"]) if r["id"] == one["recording_facts"]["recording"])
    by_hand = float(said["scale"]) * (raw["gyro_x"] - float(said["offset"])) * recording["rate_hz"]
    np.testing.assert_allclose(samples(client, recording)["gyro_x_rad_per_s"], by_hand, rtol=1e-14)


def test_a_stretch_says_from_where_its_time_counts(client: Client, job: dict) -> None:
    """time_s counts from the recording's first sample; start_s is the bench time of the stretch's own first one."""
    recording = client.recordings(job["id"])[0]
    query = {"format": "h5", "start_s": 1.0, "stop_s": 2.0}
    answer = client.http.get(f"/api/v1/recordings/{recording['id']}/samples", params=query)
    with h5py.File(io.BytesIO(answer.content)) as store:
        zero, start = (float(store.attrs[name]) for name in ("bench_time_of_time_s_0", "start_s"))
        assert (store["time_s"][0], zero) == (1.0, recording["start_s"])
        assert start == pytest.approx(zero + store["time_s"][0], abs=1e-9)
