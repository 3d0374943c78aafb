"""`python -m tests.chaos.silent_supervisor`: suspend the supervisor of a bench in a move, and then kill its worker.

Exit code 0 where the status says within seconds that nobody watches, the process that drives the bench replaces the
supervisor, the suspended one is gone when it is continued, and the new one makes the bench safe.
"""

import os
import signal
import sys
import tempfile
from contextlib import suppress
from pathlib import Path

from bench_service.bench.heartbeat import SUPERVISOR_KILLED_S, SUPERVISOR_SILENT_S
from bench_service.wall_clock import monotonic_s
from tests.benchmarks.process import free_port
from tests.end_to_end.bench_process import BenchProcess, one_master_at_a_time


def suspend_and_kill(bench: BenchProcess) -> list[str]:
    """Suspend the supervisor, then kill the worker; the seconds that each step took, as lines."""
    bench.supervised()
    first, lines = bench.files.living_supervisor(), list[str]()
    assert first is not None
    job = bench.submit(seed=7)
    bench.until(lambda: bench.moving(job), 60)
    stopped_s = monotonic_s()
    os.kill(first.pid, signal.SIGSTOP)
    safety = lambda: bench.client.get("/api/v1/benches/sim").json()["safety"]  # noqa: E731
    bench.until(lambda: safety()["silent_supervisor"] == str(first), SUPERVISOR_SILENT_S + 3.0)
    found = safety()
    assert found["supervisor"] is None, found
    assert "nobody watches over the bench" in found["explanation"], found
    assert "gives no heartbeat" in bench.client.get("/").text
    lines.append(f"said {monotonic_s() - stopped_s:.1f} s after it was suspended")
    bench.until(lambda: safety()["supervisor"] not in (None, str(first)), SUPERVISOR_KILLED_S + 10.0)
    lines.append(f"replaced after {monotonic_s() - stopped_s:.1f} s")
    with suppress(ProcessLookupError):
        os.kill(first.pid, signal.SIGCONT)
    assert not first.alive(), "it continues beside the new one"
    assert "gave no heartbeat for 10 s: killed" in bench.log.read_text()
    second = bench.files.supervisor()
    bench.until(lambda: bench.moving(job), 60)
    bench.kill()
    killed_s = monotonic_s()
    bench.until(lambda: bench.state().safe, 10)
    lines.append(f"safe {monotonic_s() - killed_s:.2f} s after the worker was killed, by {bench.state().by}")
    assert str(second) in bench.state().by
    one_master_at_a_time(bench.register.journal.entries())
    return lines


def main() -> int:
    """Suspend and kill once, on SQLite."""
    with tempfile.TemporaryDirectory(prefix="silent-") as folder:
        place = Path(folder)
        bench = BenchProcess(f"sqlite:///{place / 'bench.sqlite'}", free_port(), place, real_time_factor="2")
        bench.start()
        try:
            print(*suspend_and_kill(bench), sep="\n")
        finally:
            bench.end()
    return 0


if __name__ == "__main__":
    sys.exit(main())
