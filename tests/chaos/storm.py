"""One chaos run from an empty database to the checker's findings."""

from collections import Counter
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

from tests.chaos import books as check
from tests.chaos.books import Books, Twins
from tests.chaos.campaigns import campaigns
from tests.chaos.databases import database, engine
from tests.chaos.director import Director, Run
from tests.chaos.journals import device_side, distribution, noticed_s, rescues, struck


@dataclass(frozen=True)
class Finding:
    """Findings of one chaos run."""

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
    clients = run.clients
    wrong = [] if run.drained else [f"stuck, or never safe: {[(a.key, a.id, a.state) for a in clients.open]}"]
    wrong += [f"a client was told: {defect}" for defect in clients.defects]
    wrong += check.acknowledged(books, clients.jobs, clients.stops) + campaigns(books, clients.runs, clients.stops)
    wrong += check.histories(books) + check.results(books) + check.stations(books, twins) + check.samples(books)
    wrong += check.lost(books, run.rows.seen) + check.streams(books, run.listeners)
    wrong += device_side(run, books.notes)
    if not run.rows.seen.chunks or not run.rows.looks:
        wrong.append("the witness of the database saw nothing")
    return wrong


def figures(run: Run, books: Books) -> list[str]:
    """Figures of a run for a person."""
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
    runs = _counted(Counter(f"{row['state']} ({row['verdict']})" for row in books.runs.values()))
    steps = [step for row in books.runs.values() for step in row["document"]["steps"]]
    stops = Counter(stop.said.partition(": ")[2] for stop in run.clients.stops)
    return [
        f"{run.kills} processes killed ({_counted(killed)}), {run.restarts} database restarts, "
        f"{sum(d.how == 'SIGTERM' for d in run.topology.ledger.deaths)} orderly ends, in {run.seconds:.0f} s: "
        f"{60.0 * run.kills / run.striking_s:.1f} kills/min until the last, {run.draining_s:.0f} s until all had ended",
        f"disasters: {_counted(Counter(run.done))}",
        f"jobs: {len(books.jobs)} ({by_state}); failed of: {_counted(failures)}; attempts at most "
        f"{max(row['attempt'] for row in books.jobs.values())}; queued again because of: {_counted(again)}",
        f"campaign runs: {len(books.runs)}: {runs}; steps with a second attempt: "
        f"{sum(step['attempt'] > 1 for step in steps)} of {sum(step['attempt'] > 0 for step in steps)}",
        f"faults that struck: {_counted(Counter(struck(run)))}, {_hangs(books)} hangs; a chamber was led away from "
        f"ambient for {run.devices.warm_s:.0f} s, at {sum(rescue.warm for rescue in all_rescues)} deaths of a worker",
        f"recordings: {sealed} complete, {len(books.recordings) - sealed} interrupted; "
        f"chunks seen while it lasted: {len(run.rows.seen.chunks)} in {run.rows.looks} looks",
        f"requests without an answer: {run.clients.unanswered}; benches stopped: {_counted(stops)}",
        f"listeners: {len(run.listeners)}, {sum(li.connections for li in run.listeners)} connections, "
        f"{sum(len(li.heard) for li in run.listeners)} events",
        f"locks of living masters seen: {run.devices.locks_seen}",
        f"bench unsafe at its worker's death, supervisor alive: from kill to safe {distribution(supervised)}",
        f"bench unsafe at its worker's death, supervisor killed too: from kill to safe {distribution(alone)}",
        f"from the supervisor's notice to safe: {distribution(noticed_s(books.notes))}",
        *(f"ended by itself: {fall}" for fall in run.topology.ledger.falls),
    ]


def _hangs(books: Books) -> int:
    """How often a job was ended or queued again because a device did not answer."""
    said = [event["data"] for events in books.events.values() for event in events if event["kind"] == "state"]
    return sum("has not answered" in str(data) for data in said)


def _counted(counter: Mapping[object, int]) -> str:
    return ", ".join(f"{number} {name}" for name, number in counter.items()) or "none"
