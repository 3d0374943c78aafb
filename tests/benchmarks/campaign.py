"""``python -m tests.benchmarks.campaign``: the campaign that ships, whole and unattended, on the simulated bench.

4 × 6 h static at 100 Hz, thermal runs where the procedure is there, 3 calibrations, their scatter, verification: at
most 3 minutes from the command to JUnit XML and a verdict.
"""

import os
import subprocess
import sys
import tempfile
from datetime import datetime
from json import loads
from pathlib import Path
from xml.etree import ElementTree

from bench_service.wall_clock import monotonic_s

BUDGET_S = 180.0


def main() -> int:
    """Print the time of every step; 1 where the budget is missed or no verdict came out."""
    with tempfile.TemporaryDirectory(prefix="bench-") as folder:
        junit = Path(folder) / "junit.xml"
        command = [sys.executable, "-m", "bench_service", "campaign", "run", "thesis_acceptance", "--unit", "SIM-0001"]
        environment = {**os.environ, "BENCH_DATABASE_URL": f"sqlite:///{folder}/bench.sqlite"}
        begun = monotonic_s()
        done = subprocess.run(
            [*command, "--seed", "1", "--json", "--junit", str(junit)],
            env=environment,
            stdout=subprocess.PIPE,
            text=True,
            check=False,
        )
        took = monotonic_s() - begun
        report = loads(done.stdout)
        suites = ElementTree.parse(junit).getroot().findall("testsuite")
        size = sum(file.stat().st_size for file in Path(folder).glob("bench.sqlite*")) / 1e6
    run = report["run"]
    print(f"thesis_acceptance: {took:.1f} s from command to exit code {done.returncode}, budget {BUDGET_S:.0f} s")
    print(f"  verdict {run['verdict']}, {run['duration_s'] / 3600:.1f} h of bench time, database {size:.0f} MB")
    for step, suite in zip(run["steps"], suites, strict=True):
        bad = [check["name"] for check in step["checks"] if not check["passed"]]
        seconds = 0.0
        if step["started_at"] and step["finished_at"]:
            first, last = (datetime.fromisoformat(step[name]) for name in ("started_at", "finished_at"))
            seconds = (last - first).total_seconds()
        said = "; ".join(filter(None, [step["reason"], ", ".join(bad)]))
        cases = f"{suite.get('tests')} cases"
        print(f"  {step['name']:14} {seconds:6.1f} s  {step['state']:9} {step['verdict'] or '–':5} {cases:9} {said}")
    return 0 if took <= BUDGET_S and run["verdict"] in ("pass", "fail") else 1


if __name__ == "__main__":
    sys.exit(main())
