"""Requests of a test to the service."""

import json
from urllib.parse import quote

import httpx

from bench_service.wall_clock import monotonic_s, pause

FAST = {"dwell_s": 5.0, "settle_s": 0.5}
"""A short plan: the service is tested with it, not the numbers."""
ENDED = ("succeeded", "failed", "cancelled", "interrupted")


class Client:
    """An HTTP client with the sentences that tests use."""

    def __init__(self, http: httpx.Client) -> None:
        self.http = http

    def submit(self, procedure: str = "calibration_12_orientations", **body: object) -> dict:
        parameters = {} if procedure == "no_operation" else FAST
        answer = self.http.post(
            "/api/v1/jobs", json={"procedure": procedure, "unit": "SIM-0001", "parameters": parameters, **body}
        )
        assert answer.status_code == 202, answer.text
        assert answer.headers["Location"] == f"/api/v1/jobs/{answer.json()['id']}"
        return answer.json()

    def job(self, job_id: str) -> dict:
        return self.http.get(f"/api/v1/jobs/{job_id}").json()

    def wait(self, job_id: str, *states: str, seconds: float = 60.0) -> dict:
        deadline, look_s = monotonic_s() + seconds, 0.01
        while (job := self.job(job_id))["state"] not in (states or ENDED):
            assert monotonic_s() < deadline, f"job {job_id} is still {job['state']}: {job}"
            pause(look_s)
            look_s = min(1.2 * look_s, 0.1)  # a look takes the service's time, which the job shares
        return job

    def calibrate(self, seed: int, **parameters: object) -> dict[str, str]:
        """Calibrate the unit and choose both triads whatever the verdict; ids by triad, gyros first.

        A short plan misses the limits of the thesis, and a calibration that failed counts only where it is chosen.
        """
        job = self.wait(self.submit(seed=seed, **({"parameters": parameters} if parameters else {}))["id"])
        assert job["state"] == "succeeded", job
        path = "/api/v1/units/SIM-0001/calibrations"
        made = {c["triad"]: c["id"] for c in self.http.get(path).json()["items"] if c["result"] == job["result"]}
        for calibration in made.values():
            chosen = self.http.post(f"{path}/{calibration}/choose", json={"remark": "a short plan, for a test"})
            assert chosen.status_code == 200, chosen.text
        return {triad: made[triad] for triad in ("gyro", "accelerometer")}

    def recordings(self, job_id: str) -> list[dict]:
        return self.http.get("/api/v1/recordings", params={"job": job_id, "limit": 500}).json()["items"]

    def stored(self) -> dict[str, list[str]]:
        """The ids of everything that is stored: to show that a refusal left nothing behind."""
        pages = {name: f"/api/v1/{name}" for name in ("jobs", "recordings", "results")}
        for unit in self.http.get("/api/v1/units").json():
            serial = quote(unit["serial"], safe="")
            pages[unit["serial"]] = f"/api/v1/units/{serial}/calibrations"
        return {
            name: [item["id"] for item in self.http.get(path, params={"limit": 500}).json()["items"]]
            for name, path in pages.items()
        }

    def preview(self, procedure: str = "calibration_12_orientations", **parameters: object) -> httpx.Response:
        body = {"unit": "SIM-0001", "parameters": parameters}
        return self.http.post(f"/api/v1/procedures/{procedure}/preview", json=body)

    def import_files(self, description: object, *files: bytes, key: str | None = None) -> httpx.Response:
        """Send files as one recording; a description that is no text is sent as JSON."""
        text = description if isinstance(description, str) else json.dumps(description)
        parts = [("files", (f"file{number}.csv", data)) for number, data in enumerate(files)]
        headers = {} if key is None else {"Idempotency-Key": key}
        return self.http.post("/api/v1/recordings", files=parts, data={"description": text}, headers=headers)

    def analyse(self, method: str, **body: object) -> httpx.Response:
        return self.http.post("/api/v1/analyses", json={"method": method, **body})
