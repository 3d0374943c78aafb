"""``python -m tests.benchmarks.thermal_cycle``: a whole thermal cycle through REST on an empty database.

Three runs of 12 h × 100 Hz × 13 channels with x, y and z up, 3 h off before each: simulated, stored, analysed, judged
(budgets: 60 s of wall time, 500 MB).
"""

import sys

import psutil

from bench_service.wall_clock import monotonic_s
from tests.benchmarks.process import service

BUDGET_S = 60.0
BUDGET_MB = 500.0
POLL_S = 0.2


def main() -> int:
    """Print time, memory and size; 1 where a budget is missed."""
    with service() as running:
        begun = monotonic_s()
        job = running.finish(POLL_S, procedure="thermal_cycle", parameters={})
        took = monotonic_s() - begun
        busy = psutil.Process(running.process.pid).cpu_times()
        memory = running.peak_memory_mb()
        again = monotonic_s()
        running.client.post(f"/api/v1/jobs/{job['id']}/analyses", json={}).raise_for_status()
        again = monotonic_s() - again
        shown = monotonic_s()
        page = running.client.get(job["page"]).raise_for_status()
        shown = monotonic_s() - shown
        recordings = running.client.get("/api/v1/recordings", params={"job": job["id"]}).json()["items"]
        result = running.client.get(f"/api/v1/jobs/{job['id']}/result").raise_for_status()
    values = sum(r["count"] * len(r["channels"]) for r in recordings)
    hours = sum(r["count"] / r["rate_hz"] for r in recordings) / 3600.0
    print(f"thermal cycle, {len(recordings)} runs, {hours:.1f} h, {values / 1e6:.0f} M values: {took:.1f} s")
    print(f"  verdict {job['verdict']}; of which the analysis {again:.1f} s; budget {BUDGET_S:g} s")
    print(f"  processor time until the verdict {busy.user + busy.system:.1f} s: the wall time of an idle machine")
    print(f"  result {len(result.content) / 1e6:.2f} MB, page {shown:.1f} s, {len(page.text) / 1e6:.1f} MB")
    print(f"  peak memory {memory:.0f} MB, budget {BUDGET_MB:g} MB")
    return 0 if took <= BUDGET_S and memory <= BUDGET_MB else 1


if __name__ == "__main__":
    sys.exit(main())
