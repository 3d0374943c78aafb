"""What a test says to the service."""

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
        deadline = monotonic_s() + seconds
        while (job := self.job(job_id))["state"] not in (states or ENDED):
            assert monotonic_s() < deadline, f"job {job_id} is still {job['state']}: {job}"
            pause(0.02)
        return job

    def recordings(self, job_id: str) -> list[dict]:
        return self.http.get("/api/v1/recordings", params={"job": job_id, "limit": 500}).json()["items"]
