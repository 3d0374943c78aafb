"""The checker of the device side: who commanded a bench, and for how long it was left in harm's way.

From the devices' journals and the kernel's locks alone; of the service's own words only its notes of rescues are read.
"""

import json
import re
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from datetime import datetime
from pathlib import Path
from typing import Any

import numpy as np

from tests.chaos.director import Run
from tests.chaos.processes import Death, Ledger

NOTICED = re.compile(r"made safe by the supervisor (\d+\.\d+) s after it noticed")
NOTICE_LIMIT_S = 2.0
"""From the supervisor's noticing to a safe bench [s]: the promise."""


def journal(folder: Path, bench: str) -> list[dict[str, Any]]:
    """Every line that is kept, oldest first."""
    path = folder / f"bench-{bench}.journal"
    old = sorted(folder.glob(f"{path.name}.*"), key=lambda file: -int(file.suffix[1:]))
    found: list[dict[str, Any]] = []
    for file in (*old, path):
        for line in file.read_text().splitlines() if file.exists() else ():
            try:
                found.append(json.loads(line))
            except ValueError:
                continue  # of a process that was killed while it wrote
    return found


def masters(bench: str, entries: Iterable[dict[str, Any]], ledger: Ledger) -> list[str]:
    """Two processes that commanded one bench at once; a demand by a process that was dead, or had no link."""
    wrong: list[str] = []
    master: int | None = None
    for entry in entries:
        pid, at = entry["pid"], datetime.fromisoformat(entry["at"]).timestamp()
        said = f"bench {bench}, {entry['at']}: {entry['verb']} by process {pid}"
        if entry["verb"] == "link.refused":
            continue
        death = ledger.of(pid)
        if death is not None and at > death.gone:
            wrong.append(f"{said}, which was gone since {death.gone}")
        if entry["verb"] == "link.opened":
            before = None if master is None else ledger.of(master)
            if master is not None and master != pid and (before is None or at < before.earliest):
                wrong.append(f"{said} while process {master} had the link, and lived")
            master = pid
        elif master != pid:
            wrong.append(f"{said} while process {master} had the link")
        elif entry["verb"] == "link.closed":
            master = None
    return wrong


def struck(run: Run) -> Iterator[str]:
    """Faults of the benches' devices, by the failures that the journals have."""
    for bench in run.topology.benches:
        for entry in journal(run.folder, bench):
            error = entry["arguments"].get("error", "")
            if "an injected fault" in error:
                device = entry["verb"].partition(".")[0]
                kinds = {"lost": "lost link", "no link": "disconnect"}
                yield f"{device} {next((kind for words, kind in kinds.items() if words in error), 'fault')}"


@dataclass(frozen=True)
class Rescue:
    """A bench that a killed worker left unsafe, and how long it stayed so [s]; None: to the end."""

    bench: str
    death: Death
    supervised: bool
    warm: bool
    """Whether the chamber was led away from ambient."""
    seconds: float | None


def rescues(run: Run) -> list[Rescue]:
    """Rescue after each killed worker that left its bench unsafe."""
    found: list[Rescue] = []
    for bench, worker in run.topology.workers.items():
        for death in run.topology.ledger.deaths:
            if death.name != worker.name or death.how != "SIGKILL":
                continue
            safe, seconds = run.devices.safe_after(bench, death.told)
            if not safe:
                warm = run.devices.warm_at(bench, death.told)
                found.append(Rescue(bench, death, death.pid not in run.unsupervised, warm, seconds))
    return found


def noticed_s(notes: Iterable[str]) -> list[float]:
    """From the supervisors' notes: how long each rescue took from its notice [s]."""
    return [float(match.group(1)) for note in notes if (match := NOTICED.search(note))]


def device_side(run: Run, notes: Iterable[str]) -> list[str]:
    """Everything that is wrong on the device side of a run."""
    wrong = list(run.devices.wrong)
    for bench in run.topology.benches:
        entries = journal(run.folder, bench)
        if not entries:
            wrong.append(f"bench {bench}: nobody ever commanded it")
        wrong += masters(bench, entries, run.topology.ledger)
        sights = run.devices.sights[bench]
        if not sights or not sights[-1].safe:
            wrong.append(f"bench {bench} is not safe at the end")
    for rescue in rescues(run):
        if rescue.seconds is None:
            wrong.append(f"bench {rescue.bench} was never safe after {rescue.death}")
    wrong += [f"a rescue took {s} s from its notice" for s in noticed_s(notes) if s > NOTICE_LIMIT_S]
    return wrong


def distribution(seconds: Sequence[float]) -> str:
    """Count, median, 95 % and longest, for a person."""
    if not seconds:
        return "none"
    median, high = np.quantile(seconds, (0.5, 0.95))
    return f"{len(seconds)}: median {median:.3f} s, 95 % {high:.3f} s, longest {max(seconds):.3f} s"
