"""The checker of what is stored after a run: every row against what was acknowledged, and against an undisturbed run.

Reads the tables by SQL and the samples by Parquet; knows the content hash's definition, not the service's code of it.
"""

import hashlib
import io
import json
from collections import Counter
from collections.abc import Callable, Iterable, Mapping
from datetime import UTC, datetime
from typing import Any

import numpy as np
import pyarrow.parquet as pq
import sqlalchemy as sa

from tests.chaos.load import Asked, Stop
from tests.chaos.witnesses import Listener, Seen

LEGAL = {
    None: {"queued"},
    "queued": {"running", "paused", "cancelled"},
    "running": {"queued", "paused", "succeeded", "failed", "cancelled", "interrupted"},
    "paused": {"queued", "cancelled"},
    "interrupted": {"queued", "cancelled"},
    "failed": {"queued"},
    "succeeded": set(),
    "cancelled": set(),
}
"""Which state may follow which, as the service's documents say; a queued job fails or is interrupted in no run here."""
INJECTED = ("an injected fault", "the turntable has not answered turntable.move_to")
"""What a failure says that was meant to happen: a fault, a lost link, a hang."""
LATE_S = 60.0
"""How long after a stop a job may still end for it [s]: its process may be killed and started again meanwhile."""
Row = dict[str, Any]
Twins = Mapping[str, Mapping[int, str]]
"""Of an undisturbed run: for each kind of job (`twin_key`), the content hash of each station."""


class Books:
    """All rows but the samples', in memory."""

    def __init__(self, engine: sa.Engine) -> None:
        self.engine = engine
        self.jobs = {row["id"]: row for row in self._rows("SELECT * FROM jobs")}
        self.runs = {row["id"]: row for row in self._rows("SELECT * FROM campaign_runs")}
        for row in self.runs.values():
            row["labels"] = row["document"]["labels"]
        self.recordings = self._rows("SELECT * FROM recordings ORDER BY id")
        self.results = self._rows("SELECT * FROM results")
        self.used = self._rows("SELECT * FROM result_recordings")
        self.events: dict[str, list[Row]] = {}
        for row in self._rows("SELECT * FROM events ORDER BY job_id, sequence"):
            self.events.setdefault(row["job_id"], []).append(row)

    @property
    def notes(self) -> list[str]:
        """Everything that was noted of any job, as text."""
        return [event["data"].get("text", "") for events in self.events.values() for event in events]

    def chunks(self, recording: str) -> list[Row]:
        return self._rows("SELECT * FROM chunks WHERE recording_id = :id ORDER BY number", id=recording)

    def _rows(self, query: str, **values: Any) -> list[Row]:
        with self.engine.connect() as connection:
            return [_documents(dict(row)) for row in connection.execute(sa.text(query), values).mappings()]


def _documents(row: Row) -> Row:
    """SQLite gives JSON as text."""
    for name in ("data", "failure", "labels", "channels", "parameters", "requested_parameters", "document"):
        if isinstance(row.get(name), str):
            row[name] = json.loads(row[name])
    return row


def twin_key(procedure: str, parameters: Mapping[str, Any], seed: int) -> str:
    """Jobs with the same key have the same samples."""
    return json.dumps([procedure, dict(parameters), seed], sort_keys=True)


def promised(rows: Mapping[str, Row], asked: Iterable[Asked], bad_end: Callable[[Row, Asked], str]) -> list[str]:
    """Acknowledged jobs: each is there, once, under the one id that was said, and ended as it may."""
    wrong: list[str] = []
    by_label = Counter(row["labels"].get("chaos") for row in rows.values())
    for one in asked:
        label = one.body["labels"]["chaos"]
        if len(set(one.ids)) > 1:
            wrong.append(f"{one.key}: acknowledged as {sorted(set(one.ids))}")
        if by_label[label] != 1:
            wrong.append(f"{one.key}: there are {by_label[label]} of it")
        row = rows.get(one.id)
        if row is None:
            wrong.append(f"{one.key}: {one.id!r} is lost")
            continue
        why = bad_end(row, one)
        if why:
            wrong.append(f"{one.key}, {one.id}: {why}")
    return wrong


def acknowledged(books: Books, jobs: Iterable[Asked], stops: Iterable[Stop]) -> list[str]:
    """Jobs that were promised. `stops`: all of the run, as the clients saw them."""
    stops = tuple(stops)
    return promised(books.jobs, jobs, lambda row, asked: bad_end(row, asked.cancel_asked, stops))


def bad_end(row: Row, cancel_asked: bool, stops: Iterable[Stop]) -> str:
    """Fault of a job's end; empty: there is none."""
    state, failure = row["state"], row["failure"] or {}
    if state == "succeeded":
        return "" if row["verdict"] in ("pass", "fail") and row["result_id"] else f"no verdict or result: {row}"
    if state == "cancelled":
        stopped = any(_ended_by(row, stop) for stop in stops)
        return "" if cancel_asked or stopped else f"{row['procedure']} was cancelled, and nobody asked"
    if state == "failed":
        meant = any(words in failure.get("message", "") for words in INJECTED)
        return "" if meant else f"{row['procedure']} failed of itself: {failure}"
    return f"it is {state} at the end: {failure}"


def _ended_by(row: Row, stop: Stop) -> bool:
    """Whether a job ended while its bench was stopped, or soon after."""
    begun = moment(stop.said.partition(": ")[0])
    return stop.bench == row["bench"] and begun <= moment(row["finished_at"]) <= stop.until + LATE_S


def moment(value: str | datetime) -> float:
    """A moment as either database gives it, and as a document has it [s, Unix time]; without a zone it is UTC."""
    at = datetime.fromisoformat(value) if isinstance(value, str) else value
    return (at if at.tzinfo else at.replace(tzinfo=UTC)).timestamp()


def histories(books: Books) -> list[str]:
    """Events: no gap in any job's sequence, no illegal change of state, and the last one is the row's."""
    wrong: list[str] = []
    for job, row in books.jobs.items():
        events = books.events.get(job, [])
        if [event["sequence"] for event in events] != list(range(1, len(events) + 1)):
            wrong.append(f"job {job}: sequences {[event['sequence'] for event in events]}")
        state, done = None, set[int]()
        for event in events:
            data = event["data"]
            if event["kind"] == "station":
                if data["station"] in done:
                    wrong.append(f"job {job}: station {data['station']} is said to be done twice")
                done.add(data["station"])
            if event["kind"] != "state":
                continue
            if data["state"] not in LEGAL[state] or data.get("before") != state:
                wrong.append(f"job {job}: {state} became {data}")
            state = data["state"]
        if state != row["state"]:
            wrong.append(f"job {job}: its events end with {state}, its row says {row['state']}")
        if row["state"] == "running":
            wrong.append(f"job {job} is running, and nothing is left that runs it")
    return wrong


def results(books: Books) -> list[str]:
    """One result for each job that succeeded, of its own complete recordings; at most one for any other."""
    wrong: list[str] = []
    of_job: dict[str, list[str]] = {}
    for result in books.results:
        of_job.setdefault(result["job_id"], []).append(result["id"])
    complete = {row["id"]: row for row in books.recordings if row["state"] == "complete"}
    used = {(row["result_id"], row["recording_id"]): row["content_hash"] for row in books.used}
    for job, row in books.jobs.items():
        found = of_job.get(job, [])
        if len(found) > 1 or (row["state"] == "succeeded" and found != [row["result_id"]]):
            wrong.append(f"job {job} is {row['state']} with results {found}, of which {row['result_id']} counts")
        mine = {id_ for id_, recording in complete.items() if recording["job_id"] == job}
        if row["state"] == "succeeded" and {r for result, r in used if result == row["result_id"]} != mine:
            wrong.append(f"job {job}: its result is not of its {len(mine)} recordings")
    for (result, recording), content in used.items():
        if recording not in complete or complete[recording]["content_hash"] != content:
            wrong.append(f"result {result} used recording {recording}, which is not what it was")
    return wrong


def stations(books: Books, twins: Twins) -> list[str]:
    """Complete recordings: all stations of a job that succeeded, none twice, the same bytes as without disturbance."""
    wrong: list[str] = []
    of_job: dict[str, list[Row]] = {}
    for row in books.recordings:
        if row["state"] == "open":
            wrong.append(f"recording {row['id']} of job {row['job_id']} was never closed")
        if row["state"] == "complete":
            of_job.setdefault(row["job_id"], []).append(row)
    for job, row in books.jobs.items():
        mine = of_job.get(job, [])
        found = {recording["station_index"]: recording["content_hash"] for recording in mine}
        if len(found) != len(mine):
            wrong.append(f"job {job}: a station is there twice")
        key = twin_key(row["procedure"], row["requested_parameters"], row["seed"])
        if key not in twins:
            wrong.append(f"job {job}: nobody asked for one like {key}")
            continue
        twin = twins[key]
        missing = set(twin) - set(found) if row["state"] == "succeeded" else set()
        if missing:
            wrong.append(f"job {job} succeeded without stations {sorted(missing)}")
        other = sorted(index for index, content in found.items() if twin.get(index) != content)
        if other:
            wrong.append(f"job {job} ({row['procedure']}, seed {row['seed']}): stations {other} differ from the twin's")
    return wrong


def samples(books: Books) -> list[str]:
    """Chunks: numbered without gap, counts that add up, payloads and contents with the hashes that they claim."""
    wrong: list[str] = []
    for row in books.recordings:
        chunks, said = books.chunks(row["id"]), f"recording {row['id']} ({row['state']})"
        if [chunk["number"] for chunk in chunks] != list(range(row["chunks"])):
            wrong.append(f"{said}: chunks {[chunk['number'] for chunk in chunks]} of {row['chunks']}")
        names = [channel["name"] for channel in row["channels"]]
        content, count = hashlib.sha256(_header(row)), 0
        for chunk in chunks:
            payload = bytes(chunk["payload"])
            if hashlib.sha256(payload).hexdigest() != chunk["sha256"]:
                wrong.append(f"{said}: the payload of chunk {chunk['number']} is not what was written")
                continue
            table = pq.read_table(io.BytesIO(payload), use_threads=False).select(names)
            if chunk["start_sample"] != count or chunk["samples"] != table.num_rows:
                wrong.append(f"{said}: chunk {chunk['number']} begins at {chunk['start_sample']}, not {count}")
            count += table.num_rows
            columns = [table.column(name).to_numpy() for name in names]
            content.update(np.column_stack(columns).astype(np.dtype(row["sample_type"]).newbyteorder("<")).tobytes())
        if count != row["samples"]:
            wrong.append(f"{said}: {count} samples, {row['samples']} are claimed")
        if content.hexdigest() != row["content_hash"]:
            wrong.append(f"{said}: its content has another hash than it claims")
    return wrong


def lost(books: Books, seen: Seen) -> list[str]:
    """Rows that were once read as committed, and are missing now or changed."""
    complete = {row["id"]: row["content_hash"] for row in books.recordings if row["state"] == "complete"}
    wrong = [
        f"recording {recording} was sealed, and is lost or changed"
        for recording, content in seen.complete.items()
        if complete.get(recording) != content
    ]
    with books.engine.connect() as connection:
        rows = connection.execute(sa.text("SELECT recording_id, number, sha256 FROM chunks"))
        now = {(row[0], row[1]): row[2] for row in rows}
    gone = [place for place, sha in seen.chunks.items() if now.get(place) != sha]
    wrong += [
        f"chunk {number} of recording {recording} was there, and is lost or changed" for recording, number in gone
    ]
    by_job: dict[str, set[str]] = {}
    for row in books.recordings:
        if row["state"] == "complete":
            by_job.setdefault(row["job_id"], set()).add(row["content_hash"])
    for (job, sequence), content in seen.stations.items():
        if content not in by_job.get(job, set()):
            wrong.append(f"job {job}: event {sequence} told of a recording that is not there")
    return wrong


def streams(books: Books, listeners: Iterable[Listener]) -> list[str]:
    """Events that listeners heard, across lost connections, against the table: none missed, doubled or changed."""
    wrong: list[str] = []
    for listener in listeners:
        table = [(event["sequence"], event["kind"], event["data"]) for event in books.events.get(listener.job, [])]
        if listener.heard != table:
            wrong.append(
                f"job {listener.job}: heard {[number for number, *_ in listener.heard]}, "
                f"the table has {[number for number, *_ in table]}"
            )
    return wrong


def _header(row: Row) -> bytes:
    """The first line of what a content hash is made of."""
    channels = [[c["name"], c["quantity"], c["unit"], float(c["scale"]), float(c["offset"])] for c in row["channels"]]
    document = {"channels": channels, "dtype": row["sample_type"], "rate_hz": float(row["rate_hz"])}
    return (json.dumps(document, sort_keys=True, separators=(",", ":")) + "\n").encode()
