"""Whether two revisions make the same of the same seeds: recordings by their content hash, results number by number.

    python -m tests.benchmarks.alike [--rev main]

Prints, for each job, whether the hashes of its recordings are equal, and the largest relative difference of any number
of its result; a text that differs is shown. Exit code 1 where a hash or a text differs, or a number by more than
`TOLERANCE`, what the fast sums of an analysis promise. A result's ids and times are left out.
"""

import argparse
import subprocess
import sys
from collections.abc import Iterator
from typing import Any

from tests.benchmarks.measures import POLL_S
from tests.benchmarks.process import Service
from tests.benchmarks.revision import Revision, built, here

TOLERANCE = 1e-6
JOBS: dict[str, dict[str, Any]] = {
    "a launch that processes share": {
        "procedure": "static_run",
        "parameters": {"launches": 1, "duration_s": 3600.0, "off_time_s": 1.0},
    },
    "three launches": {
        "procedure": "static_run",
        "parameters": {"launches": 3, "duration_s": 1200.0, "off_time_s": 60.0},
    },
    "calibration": {"procedure": "calibration_12_orientations", "parameters": {}},
    "thermal cycle": {"procedure": "thermal_cycle", "parameters": {}},
}
METHODS = ("allan_deviation", "noise_analysis")
SKIPPED = frozenset({"id", "recording", "recordings", "made_at", "created_at", "job_id", "code_version", "basis"})

Found = dict[str, tuple[list[str], Any]]
"""By job: content hashes of its recordings, and its result's document."""


def main() -> int:
    """Run the jobs on both revisions and compare."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--rev", default="main")
    with built(parser.parse_args().rev) as old:
        return compared(old, here())


def compared(old: Revision, new: Revision) -> int:
    """Print the comparison; 1 where something differs."""
    before, after, worst = made(old), made(new), 0
    for name, (hashes, document) in after.items():
        same = hashes == before[name][0]
        numbers, texts = 0.0, list[str]()
        for path, one, other in pairs("", before[name][1], document):
            if isinstance(one, float | int) and isinstance(other, float | int) and not isinstance(one, bool):
                scale = max(abs(one), abs(other))
                numbers = max(numbers, abs(one - other) / scale if scale else 0.0)
            elif one != other:
                texts.append(f"    {path}: {one!r} -> {other!r}")
        worst |= not same or bool(texts) or numbers > TOLERANCE
        print(f"{name}: {len(hashes)} recordings {'alike' if same else 'DIFFER'}, numbers within {numbers:.1e}")
        print("\n".join(texts[:20]), end="\n" if texts else "", flush=True)
    return int(worst)


def made(revision: Revision) -> Found:
    """Run all jobs and methods on an empty database."""
    found: Found = {}
    with revision.service() as running:
        for name, body in JOBS.items():
            job = running.finish(POLL_S, seed=7, **body)
            items = running.client.get("/api/v1/recordings", params={"job": job["id"]}).json()["items"]
            hashes = [item["content_hash"] for item in items]
            document = running.client.get(f"/api/v1/jobs/{job['id']}/result").raise_for_status().json()
            found[name] = hashes, document["document"]
            if name == "three launches":
                for method in METHODS:
                    found[method] = hashes[:1], _method(running, method, items[0]["id"])
    return found


def _method(running: Service, name: str, recording: str) -> Any:
    body = {"method": name, "recordings": [recording]}
    return running.client.post("/api/v1/analyses", json=body).raise_for_status().json()["document"]


def pairs(path: str, one: Any, other: Any) -> Iterator[tuple[str, Any, Any]]:
    """All leaves of two documents by their path; a leaf that only one of them has stands beside None."""
    if isinstance(one, dict) and isinstance(other, dict):
        for key in sorted({*one, *other} - SKIPPED):
            yield from pairs(f"{path}.{key}", one.get(key), other.get(key))
    elif isinstance(one, list) and isinstance(other, list) and len(one) == len(other):
        for i, (a, b) in enumerate(zip(one, other, strict=True)):
            yield from pairs(f"{path}[{i}]", a, b)
    else:
        yield path, one, other


if __name__ == "__main__":
    try:
        sys.exit(main())
    except subprocess.CalledProcessError as failed:
        print(f"not run: {' '.join(failed.cmd[:6])} ended with {failed.returncode}", file=sys.stderr)
        sys.exit(1)
