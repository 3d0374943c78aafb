"""Hostile files at the readers, at the service, and large ones against the clock and the memory.

``python -m tests.validation.imports [--files N] [--http N] [--bombs]``. Exit code 1 where a file makes anything else
than a recording or a refusal of bounded length, or takes more memory or time than is promised. Arrow itself ends the
process at some files, so each batch is read in a process of its own here as in the service.
"""

import argparse
import io
import json
import os
import re
import sys
import warnings
from collections import Counter
from collections.abc import Callable
from dataclasses import dataclass, field

from pydantic import ValidationError
from rich.console import Console

from bench_service.formats.description import ImportDescription
from bench_service.formats.import_file import ImportFile, read_import
from bench_service.wall_clock import monotonic_s
from procedures.core.errors import DomainError
from tests.benchmarks.process import service as running_service
from tests.validation.hostile_bombs import BOMBS, measured
from tests.validation.hostile_files import HostileFiles

SEED = 7
BATCH = 500
SLOW_S = 5.0
LONGEST = 2000
"""Characters of a message."""
MEMORY_MB, TIME_S, DELAY_S = 300.0, 30.0, 0.2
console = Console()


@dataclass
class Tally:
    """Outcomes of many files."""

    recordings: int = 0
    refusals: Counter[str] = field(default_factory=Counter)
    ended: list[int] = field(default_factory=list)
    """Files at which the process that read them ended: in the service, a refusal."""
    faults: list[str] = field(default_factory=list)


def kind_of(message: str) -> str:
    """A refusal without its names and numbers."""
    return re.sub(r"'[^']*'|\d[\d.e+-]*", "#", message)[:110]


def read_one(number: int, files: HostileFiles) -> tuple[str, str]:
    """Outcome of a file read in this process: "ok", "refused" or "fault", and the words."""
    data, description = files.file(number)
    begun = monotonic_s()
    try:
        imported = read_import([ImportFile("f", io.BytesIO(data))], ImportDescription.model_validate(description))
        rows = sum(len(block) for block in imported.blocks())
        found = (
            ("ok", "") if rows == imported.count else ("fault", f"{rows} rows where {imported.count} were announced")
        )
    except (DomainError, ValidationError) as error:  # of the description: 422 over HTTP, by its field
        message = error.errors()[0]["msg"] if isinstance(error, ValidationError) else str(error)
        found = ("refused", message) if len(message) <= LONGEST else ("fault", f"a message of {len(message)}")
    except MemoryError:
        found = ("refused", "takes more memory than is allowed")
    except Exception as error:
        found = ("fault", f"{type(error).__name__}: {str(error)[:200]}")
    took_s = monotonic_s() - begun
    return found if took_s < SLOW_S else ("fault", f"{took_s:.1f} s")


def parsers(count: int) -> Tally:
    """Read so many files, each batch in a process of its own that goes on after the file that ended it."""
    tally, number = Tally(), 0
    while number < count:
        lines = _forked(number, min(count, number + BATCH))
        for kind, words in lines:
            if kind == "ok":
                tally.recordings += 1
            elif kind == "refused":
                tally.refusals[kind_of(words)] += 1
            else:
                tally.faults.append(f"file {number}: {words}")
            number += 1
        if len(lines) < BATCH and number < count:
            tally.ended.append(number)
            number += 1
    return tally


def _forked(begin: int, end: int) -> list[tuple[str, str]]:
    """Outcomes of some files, up to the one at which the process ended."""
    reading, writing = os.pipe()
    child = os.fork()
    if not child:
        os.close(reading)
        os.dup2(os.open(os.devnull, os.O_WRONLY), 2)
        warnings.simplefilter("error")
        files = HostileFiles(SEED)
        with os.fdopen(writing, "w") as out:
            for number in range(begin, end):
                out.write(json.dumps(read_one(number, files)) + "\n")
                out.flush()
        os._exit(0)
    os.close(writing)
    with os.fdopen(reading) as lines:
        found = [tuple(json.loads(line)) for line in lines if line.endswith("\n")]
    os.waitpid(child, 0)
    return found


def over_http(count: int) -> Tally:
    """Send so many files to a service that runs."""
    tally, files = Tally(), HostileFiles(SEED + 1)
    with running_service() as service:
        for number in range(count):
            data, description = files.file(number)
            answer = service.client.post(
                "/api/v1/recordings", files=[("files", ("f", data))], data={"description": json.dumps(description)}
            )
            if answer.status_code == 201:
                tally.recordings += 1
            elif answer.status_code == 422 and len(answer.content) < 3 * LONGEST:
                tally.refusals[kind_of(answer.json()["detail"])] += 1
            else:
                tally.faults.append(f"file {number}: {answer.status_code}, {len(answer.content)} bytes")
    return tally


def report(title: str, tally: Tally, count: int, took_s: float) -> bool:
    """Print a tally; whether it is as it must be."""
    refused = sum(tally.refusals.values())
    console.print(
        f"{title}: {count} files in {took_s:.0f} s: {tally.recordings} recordings, {refused} refusals of "
        f"{len(tally.refusals)} kinds, {len(tally.ended)} ended their process, {len(tally.faults)} faults"
    )
    for kind, times in tally.refusals.most_common(20):
        console.print(f"  {times:6d}  {kind}", markup=False, soft_wrap=True)
    for fault in tally.faults[:20]:
        console.print(f"  FAULT {fault}", markup=False, soft_wrap=True)
    return not tally.faults


def bombs(only: str) -> bool:
    """Large and hostile files against what is promised."""
    held = True
    for name, bomb in BOMBS.items():
        if only not in name:
            continue
        data = bomb.make()
        with running_service() as service:
            found = measured(service, bomb, data)
        good = found.memory_mb <= MEMORY_MB and found.time_s <= TIME_S and found.late_s <= DELAY_S
        good = good and found.status in (201, 413, 422)
        held = held and good
        mark = "ok " if good else "BAD"
        console.print(
            f"  {mark} {name:34s} {found.sent_mb:7.1f} MB sent: {found.status}, {found.time_s:5.1f} s, "
            f"{found.memory_mb:+6.0f} MB, healthz {found.delay_s:.3f} s at most (before: {found.quiet_s:.3f} s), "
            f"stop {found.stop_s:.3f} s (before: {found.stop_quiet_s:.3f} s); {found.words}",
            markup=False,
            soft_wrap=True,
        )
    return held


def timed(work: Callable[[int], Tally], title: str, count: int) -> bool:
    """Run one part; whether it held."""
    begun = monotonic_s()
    return report(title, work(count), count, monotonic_s() - begun)


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--files", type=int, default=20_000)
    parser.add_argument("--http", type=int, default=1000)
    parser.add_argument("--only", default="", help="bombs whose name has these words")
    parser.add_argument("--bombs", action=argparse.BooleanOptionalAction, default=True)
    asked = parser.parse_args()
    held = timed(parsers, "readers", asked.files)
    held = timed(over_http, "service", asked.http) and held
    if asked.bombs:
        held = bombs(asked.only) and held
    console.print("held" if held else "NOT HELD")
    return 0 if held else 1


if __name__ == "__main__":
    sys.exit(main())
