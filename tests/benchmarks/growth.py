"""``python -m tests.benchmarks.growth [allan,static]``: cost against size, four sizes over three decades.

Processor time of the service and its processes, or of one deviation; medians of `ROUNDS`. The exponent between two
sizes is the slope of log(time) over log(size): 1 where cost is proportional, less where a part of it does not grow. The
one of the last decade is to be at most 1.05.
"""

import json
import math
import statistics
import sys
from collections.abc import Callable, Iterator

import numpy as np

from tests.benchmarks.measures import POLL_S
from tests.benchmarks.process import Service
from tests.benchmarks.revision import here

ROUNDS = 3
LIMIT = 1.05
ALLAN = """
import time, numpy as np
from procedures.analysis.allan.deviation import deviation
from procedures.analysis.allan.statistic import log_sizes
count = {count}
y, sizes = np.random.default_rng(1).normal(size=count), log_sizes(count // 2, 226)
deviation(y[:1000], 400.0)
begun = time.process_time()
deviation(y, 400.0, sizes=sizes)
print(time.process_time() - begun)
"""
CHANNEL = {"name": "gyro_x", "column": "x", "quantity": "angular_rate", "unit": "deg/s"}
DESCRIPTION = {"unit": "IMPORTED-1", "rate_hz": 100.0, "channels": [CHANNEL]}


def allan() -> Iterator[tuple[int, float]]:
    """A deviation at 200 sizes, by samples."""
    for count in (86_400, 864_000, 8_640_000, 86_400_000):
        yield count, statistics.median(float(here().script(ALLAN.format(count=count))) for _ in range(ROUNDS))


def static() -> Iterator[tuple[int, float]]:
    """A launch at 40 samples a second, by samples: simulated, stored, analysed."""
    with here().service() as running:
        _warm(running)
        for hours in (0.2, 2.0, 20.0, 200.0):
            parameters = {"launches": 1, "duration_s": hours * 3600.0, "off_time_s": 1.0, "sample_rate_hz": 40.0}
            yield round(hours * 3600 * 40), _used(running, lambda p=parameters: _job(running, "static_run", p))


def thermal() -> Iterator[tuple[int, float]]:
    """The three runs of a thermal cycle, by samples a second."""
    with here().service() as running:
        _warm(running)
        for rate_hz in (1.0, 10.0, 100.0, 1000.0):
            parameters = {"sample_rate_hz": rate_hz}
            yield round(rate_hz), _used(running, lambda p=parameters: _job(running, "thermal_cycle", p))


def imports() -> Iterator[tuple[int, float]]:
    """An import of one column of text, by rows."""
    rng = np.random.default_rng(1)
    with here().service() as running:
        for rows in (3_000, 30_000, 300_000, 3_000_000):
            text = "x\n" + "".join(f"{value:.6f}\n" for value in rng.normal(size=rows))
            yield rows, _used(running, lambda t=text: _import(running, t))


KINDS: dict[str, Callable[[], Iterator[tuple[int, float]]]] = {
    "allan": allan,
    "static": static,
    "thermal": thermal,
    "import": imports,
}


def main() -> int:
    """Print sizes, times and exponents; 1 where the last exponent is above `LIMIT`."""
    above = False
    for name in sys.argv[1].split(",") if len(sys.argv) > 1 else KINDS:
        known: list[tuple[int, float]] = []
        for size, seconds in KINDS[name]():
            known.append((size, seconds))
            print(f"{name:8} {size:>11}  {seconds:8.3f} s  {_exponent(known)}", flush=True)
        above |= _slope(known) > LIMIT
    return int(above)


def _exponent(known: list[tuple[int, float]]) -> str:
    return f"exponent {_slope(known):.2f}" if len(known) > 1 else ""


def _slope(known: list[tuple[int, float]]) -> float:
    (size, seconds), (larger, longer) = known[-2:]
    return math.log(longer / seconds) / math.log(larger / size)


def _used(running: Service, work: Callable[[], object]) -> float:
    times: list[float] = []
    for _ in range(ROUNDS):
        before = running.processor_s()
        work()
        times.append(running.processor_s() - before)
    return statistics.median(times)


def _warm(running: Service) -> None:
    """Have everything imported that a first job would wait for."""
    _job(running, "static_run", {"launches": 1, "duration_s": 600.0, "off_time_s": 1.0})


def _job(running: Service, procedure: str, parameters: dict[str, object]) -> None:
    running.finish(POLL_S, procedure=procedure, parameters=parameters)


def _import(running: Service, text: str) -> None:
    files = [("files", ("a.csv", text.encode()))]
    data = {"description": json.dumps(DESCRIPTION)}
    running.client.post("/api/v1/recordings", files=files, data=data).raise_for_status()


if __name__ == "__main__":
    sys.exit(main())
