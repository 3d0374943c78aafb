"""The checker of campaign runs: each against what was acknowledged, against its jobs, and against the other runs."""

from collections.abc import Iterable, Iterator
from itertools import pairwise
from typing import Any

from tests.chaos.books import Books, Row, bad_end, moment, promised
from tests.chaos.load import CAMPAIGN, RETRY_SEED, Asked, Stop


def campaigns(books: Books, runs: Iterable[Asked], stops: Iterable[Stop]) -> list[str]:
    """Everything that is wrong with the campaign runs of a chaos run."""
    runs, stops = tuple(runs), tuple(stops)
    wrong = promised(books.runs, runs, _bad_end)
    cancelled = {asked.id for asked in runs if asked.cancel_asked}
    for job, row in books.jobs.items():
        run = row["labels"].get("campaign_run")
        if run is None:
            continue
        if run not in books.runs:
            wrong.append(f"job {job} is of campaign run {run}, which is not there")
        why = bad_end(row, run in cancelled, stops)
        if why:
            wrong.append(f"job {job} of campaign run {run}: {why}")
    for run, row in books.runs.items():
        wrong += [f"campaign run {run}: {why}" for why in (*_steps(books, row), *_verdict(row))]
    return wrong + _overlaps(books) + _loose(books)


def _bad_end(row: Row, asked: Asked) -> str:
    state, document = row["state"], row["document"]
    if state == "cancelled":
        return "" if asked.cancel_asked else "cancelled, and nobody asked"
    if state not in ("succeeded", "failed"):
        return f"it is {state} at the end: {document['waiting']}"
    return ""


def _jobs(books: Books, row: Row, step: str | None = None) -> list[Row]:
    """Jobs that say that they are of a run, or of one step of it; oldest first."""
    of_run = [job for job in books.jobs.values() if job["labels"].get("campaign_run") == row["id"]]
    return sorted((job for job in of_run if step in (None, job["labels"]["step"])), key=lambda job: job["id"])


def _steps(books: Books, row: Row) -> Iterator[str]:
    """One job an attempt, of the right seed; a new attempt only after an error; one step after the other."""
    before = 0.0
    for number, (plan, step) in enumerate(zip(CAMPAIGN["steps"], row["document"]["steps"], strict=True)):
        jobs, said = _jobs(books, row, step["name"]), f"step {step['name']}"
        there = [job["id"] for job in jobs]
        listed = [*step["earlier_jobs"], *([step["job_id"]] if step["job_id"] else [])]
        if there != listed or ("procedure" in plan and len(there) != step["attempt"]):
            yield f"{said}: {step['attempt']} attempts, it lists jobs {listed}, there are {there}"
        seeds = [row["document"]["seed"] + number + RETRY_SEED * retry for retry in range(len(jobs))]
        if [job["seed"] for job in jobs] != seeds:
            yield f"{said}: seeds {[job['seed'] for job in jobs]} instead of {seeds}"
        if any(job["state"] == "succeeded" for job in jobs[:-1]):
            yield f"{said}: it was tried again after a verdict"
        if any(moment(job["created_at"]) < before for job in jobs):
            yield f"{said} began before the one before it had ended"
        before = max([before, *(moment(job["finished_at"]) for job in jobs if job["finished_at"])])
        yield from _outcome(books, step, jobs, said)


def _outcome(books: Books, step: dict[str, Any], jobs: list[Row], said: str) -> Iterator[str]:
    """A step's verdict and result are those of its last job, or of its method's result."""
    if step["state"] not in ("succeeded", "failed", "cancelled", "skipped"):
        yield f"{said} is {step['state']} at the end"
    judged = step["verdict"] in ("pass", "fail")
    if judged != (step["state"] == "succeeded"):
        yield f"{said} is {step['state']} with verdict {step['verdict']}"
    if not jobs:
        found = [result["verdict"] for result in books.results if result["id"] == step["result_id"]]
        if found != ([step["verdict"]] if judged else []):
            yield f"{said}: verdict {step['verdict']}, its result says {found}"
        return
    last = jobs[-1]
    if judged and (last["verdict"], last["result_id"]) != (step["verdict"], step["result_id"]):
        yield f"{said}: verdict {step['verdict']} of result {step['result_id']}, its job says {last['verdict']}"
    if last["state"] == "succeeded" and not judged and step["state"] != "cancelled":
        yield f"{said} is {step['state']}, its job succeeded"


def _verdict(row: Row) -> Iterator[str]:
    """Error where a step gave none or nothing was judged, fail where one failed, else pass; none of a cancelled run."""
    document = row["document"]
    verdicts = [step["verdict"] for step in document["steps"] if step["state"] != "skipped"]
    expected: str | None = "fail" if "fail" in verdicts else "pass"
    if not verdicts or not {*verdicts} <= {"pass", "fail"}:
        expected = "error"
    if row["state"] == "cancelled":
        expected = None
    if {row["verdict"], document["verdict"]} != {expected}:
        yield f"verdict {row['verdict']} (its document: {document['verdict']}), by its steps {expected}"
    if row["state"] != document["state"] or (expected == "error") != (row["state"] == "failed"):
        yield f"it is {row['state']} (its document: {document['state']}) with verdict {expected}"


def _overlaps(books: Books) -> list[str]:
    """Runs of one bench of which one began before the one before it had ended, by their own times and their jobs'."""
    spans: dict[str, list[tuple[float, float, str]]] = {}
    for run, row in books.runs.items():
        jobs, document = _jobs(books, row), row["document"]
        begun = [moment(job["created_at"]) for job in jobs]
        begun += [moment(document["started_at"])] if document["started_at"] else []
        ended = [moment(at) for at in (row["finished_at"], *(job["finished_at"] for job in jobs)) if at]
        if begun and ended:
            spans.setdefault(row["bench"], []).append((min(begun), max(ended), run))
    return [
        f"campaign runs {a[2]} and {b[2]} of bench {bench} overlapped"
        for bench, of_bench in spans.items()
        for a, b in pairwise(sorted(of_bench))
        if b[0] < a[1]
    ]


def _loose(books: Books) -> list[str]:
    """Results of methods that no run has: one, at most, of each run that was cancelled in the middle of a method."""
    had = {step["result_id"] for row in books.runs.values() for step in row["document"]["steps"]}
    loose = [result["id"] for result in books.results if result["job_id"] is None and result["id"] not in had]
    cancelled = sum(row["state"] == "cancelled" for row in books.runs.values())
    return [f"results {loose} are of no campaign run, {cancelled} were cancelled"] if len(loose) > cancelled else []
