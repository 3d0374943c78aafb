"""``python -m tests.benchmarks.static``: a static launch through REST, beside allantools; memory of a long one.

6 h × 400 Hz × 6 channels: simulated, stored, analysed (budget 12 s; gnss-ins-sim takes 181-264 s to make 6 h × 100 Hz
alone, simulation.md). 65 h × 400 Hz × 6 channels: peak memory of the service (budget 500 MB).
"""

import io
import statistics
import sys
import warnings

import pyarrow.ipc

from bench_service.wall_clock import monotonic_s
from tests.benchmarks.process import Service, service

with warnings.catch_warnings():
    warnings.simplefilter("ignore")
    import allantools

LAUNCH = {"launches": 1, "duration_s": 6 * 3600.0, "off_time_s": 1.0}
LONG = {**LAUNCH, "duration_s": 65 * 3600.0}
SIZES = 200
POLL_S = 0.2


def one_launch(running: Service) -> tuple[float, dict]:
    """Submit to verdict [s], and the job."""
    begun = monotonic_s()
    job = running.finish(POLL_S, procedure="static_run", parameters=LAUNCH)
    return monotonic_s() - begun, job


def peer(running: Service, job: dict) -> float:
    """Overlapping Allan by allantools of one channel of the same recording, at as many times [s]."""
    recording = running.client.get("/api/v1/recordings", params={"job": job["id"]}).json()["items"][0]
    query = {"format": "arrow", "channels": "gyro_x"}
    data = running.client.get(f"/api/v1/recordings/{recording['id']}/data", params=query).content
    counts = pyarrow.ipc.open_stream(io.BytesIO(data)).read_all().column("gyro_x").to_numpy()
    rate = recording["rate_hz"]
    taus = [10 ** (k * 6.2 / SIZES) / rate for k in range(SIZES)]
    begun = monotonic_s()
    allantools.oadev(counts * recording["channels"][0]["scale"] * rate, rate, "freq", taus)
    return monotonic_s() - begun


def main() -> int:
    """Print both budgets; 1 where one is missed."""
    with service() as running:
        found = [one_launch(running) for _ in range(3)]
        took = statistics.median(seconds for seconds, _ in found)
        again = monotonic_s()
        running.client.post(f"/api/v1/jobs/{found[-1][1]['id']}/analyses", json={}).raise_for_status()
        again = monotonic_s() - again
        theirs = peer(running, found[-1][1])
        memory = running.peak_memory_mb()
    samples = 6 * 3600 * 400 * 6
    print(f"static launch, 6 h × 400 Hz × 6 channels ({samples / 1e6:.1f} M samples): {took:.1f} s (median of 3)")
    print(f"  of which the analysis {again:.1f} s; allantools takes {6 * theirs:.0f} s for the six deviations alone")
    print(
        f"  {took / samples * 1e9:.0f} ns a sample; budget 12 s; peak memory {memory:.0f} MB, budget 500 MB", flush=True
    )
    with service() as running:
        begun = monotonic_s()
        running.finish(POLL_S, procedure="static_run", parameters=LONG)
        long = monotonic_s() - begun
        peak = running.peak_memory_mb()
    print(f"static launch of 65 h: {long:.0f} s, peak memory {peak:.0f} MB, budget 500 MB")
    return 0 if took <= 12.0 and peak <= 500.0 else 1


if __name__ == "__main__":
    sys.exit(main())
