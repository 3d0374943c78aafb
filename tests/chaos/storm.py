"""One chaos run from an empty database to the checker's findings."""

from collections import Counter
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

from tests.chaos import books as check
from tests.chaos.books import Books, Twins
from tests.chaos.databases import database, engine
from tests.chaos.director import Director, Run
from tests.chaos.journals import device_side, distribution, noticed_s, rescues


@dataclass(frozen=True)
class Finding:
    """What a run showed."""

    violations: tuple[str, ...]
    figures: tuple[str, ...]
    kills: int


def storm(kind: str, folder: Path, kills: int, seed: int, twins: Twins, most_s: float = 3600.0) -> Finding:
    """Kill processes of a service on one kind of database, in a new folder, and check what is left."""
    folder.mkdir(parents=True)
    with database(kind, folder) as made:
        run = Director(made, folder, kills, seed, most_s).direct()
        books = Books(engine(made.url))
        return Finding(tuple(violations(run, books, twins)), tuple(figures(run, books)), run.kills)


def violations(run: Run, books: Books, twins: Twins) -> list[str]:
    """Everything that is not as it must be."""
    stopped = bool(run.clients.released)
    wrong = [] if run.drained else [f"jobs are stuck: {[(a.key, a.id, a.state) for a in run.clients.open]}"]
    wrong += [f"a client was told: {defect}" for defect in run.clients.defects]
    wrong += check.acknowledged(books, run.clients.jobs, stopped)
    wrong += check.histories(books) + check.results(books) + check.stations(books, twins) + check.samples(books)
    wrong += check.lost(books, run.rows.seen) + check.streams(books, run.listeners)
    wrong += device_side(run, books.notes)
    if not run.rows.seen.chunks or not run.rows.looks:
        wrong.append("the witness of the database saw nothing")
    return wrong


def figures(run: Run, books: Books) -> list[str]:
    """What a person wants to know of a run."""
    all_rescues = rescues(run)
    by_state = _counted(Counter(row["state"] for row in books.jobs.values()))
    again = Counter(
        event["data"]["again_because"]["kind"]
        for events in books.events.values()
        for event in events
        if "again_because" in event["data"]
    )
    failures = Counter((row["failure"] or {}).get("kind") for row in books.jobs.values() if row["state"] == "failed")
    killed = Counter(death.name for death in run.topology.ledger.deaths if death.how == "SIGKILL")
    sealed = sum(row["state"] == "complete" for row in books.recordings)
    supervised = [rescue.seconds for rescue in all_rescues if rescue.supervised and rescue.seconds is not None]
    alone = [rescue.seconds for rescue in all_rescues if not rescue.supervised and rescue.seconds is not None]
    return [
        f"{run.kills} processes killed ({_counted(killed)}), {run.restarts} database restarts, "
        f"{sum(d.how == 'SIGTERM' for d in run.topology.ledger.deaths)} orderly ends, in {run.seconds:.0f} s",
        f"disasters: {_counted(Counter(run.done))}",
        f"jobs: {len(books.jobs)} ({by_state}); failed of: {_counted(failures)}; attempts at most "
        f"{max(row['attempt'] for row in books.jobs.values())}; queued again because of: {_counted(again)}",
        f"recordings: {sealed} complete, {len(books.recordings) - sealed} interrupted; "
        f"chunks seen while it lasted: {len(run.rows.seen.chunks)} in {run.rows.looks} looks",
        f"requests without an answer: {run.clients.unanswered}; benches released by a person: {run.clients.released}",
        f"listeners: {len(run.listeners)}, {sum(li.connections for li in run.listeners)} connections, "
        f"{sum(len(li.heard) for li in run.listeners)} events",
        f"locks of living masters seen: {run.devices.locks_seen}",
        f"bench unsafe at its worker's death, supervisor alive: from kill to safe {distribution(supervised)}",
        f"bench unsafe at its worker's death, supervisor killed too: from kill to safe {distribution(alone)}",
        f"from the supervisor's notice to safe: {distribution(noticed_s(books.notes))}",
        *(f"ended by itself: {fall}" for fall in run.topology.ledger.falls),
    ]


def _counted(counter: Mapping[object, int]) -> str:
    return ", ".join(f"{number} {name}" for name, number in counter.items()) or "none"
