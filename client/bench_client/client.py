"""The client: one object for one service."""

import time
from collections.abc import Callable, Generator, Iterator, Mapping, Sequence
from contextlib import ExitStack
from datetime import datetime
from json import dumps
from pathlib import Path
from types import TracebackType
from typing import Any, Self
from urllib.parse import quote

import httpx
from pydantic import TypeAdapter

from bench_client.event_stream import follow
from bench_client.recording import Recording
from bench_client.refusals import JobEnded, TimedOut
from bench_client.results import Result, result_of_document
from bench_client.transport import Transport
from bench_client.views import Event, Job, Preview, RecordingView, sent

LOOKS_S = (0.05, 2.0)
"""Interval between two looks at a job: the first, and the longest, to which it grows [s]."""
PAGE = 500
"""Largest number of items that the service gives in one page."""


class Client:
    """Client of a bench service.

    Errors are `BenchClientError`: `Refused` where the service says no, `Unavailable` where it does not answer in time.
    """

    def __init__(
        self,
        address: str,
        token: str | None = None,
        name: str | None = None,
        patience_s: float = 60.0,
        timeout_s: float = 600.0,
        http: httpx.BaseTransport | None = None,
    ) -> None:
        """`address`: for example http://127.0.0.1:8000; `token`: sent as bearer token; `name`: by which the service
        knows the person or program; `patience_s`: time for which the service may be away [s]; `timeout_s`: longest
        time of one request [s].
        """
        given = {"Authorization": token and f"Bearer {token}", "X-Requested-By": name}
        headers = {header: value for header, value in given.items() if value}
        self._http = httpx.Client(base_url=address, headers=headers, timeout=timeout_s, transport=http)
        self._patience_s = patience_s
        self._transport = Transport(self._http, patience_s)

    def __enter__(self) -> Self:
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, at: TracebackType | None) -> None:
        self.close()

    def close(self) -> None:
        """Close the connections to the service."""
        self._http.close()

    def procedures(self) -> dict[str, dict[str, Any]]:
        """Return the procedures by name, each with title, version and the JSON Schemas of parameters and result."""
        return {one["name"]: one for one in self._transport.get("/api/v1/procedures")}

    def preview(
        self, procedure: str, unit: str, parameters: Mapping[str, Any] | None = None, bench: str | None = None
    ) -> Preview:
        """Return the preview of a plan; nothing moves. Raises `Refused`, `Unavailable`."""
        body = {"unit": unit, "bench": bench, "parameters": dict(parameters or {})}
        path = f"/api/v1/procedures/{quote(procedure, safe='')}/preview"
        return Preview.model_validate(self._transport.post(path, once=False, json=body))

    def submit(
        self,
        procedure: str,
        unit: str,
        parameters: Mapping[str, Any] | None = None,
        *,
        bench: str | None = None,
        labels: Mapping[str, str] | None = None,
        priority: int | None = None,
        seed: int | None = None,
        retries: int | None = None,
        reservation: str | None = None,
        mounting: str | None = None,
        deadline_at: datetime | None = None,
        key: str | None = None,
    ) -> Job:
        """Submit a job to the queue and return it. Repeated with the same `key` and the same request it returns the
        same job. Raises `Refused`, `Unavailable`.
        """
        terms = {"bench": bench, "priority": priority, "seed": seed, "retries": retries}
        terms |= {"reservation": reservation, "mounting": mounting}
        body = {
            "procedure": procedure,
            "unit": unit,
            "parameters": dict(parameters or {}),
            "labels": dict(labels or {}),
        }
        made = self._transport.post("/api/v1/jobs", key, json=body | sent({**terms, "deadline_at": deadline_at}))
        return Job.model_validate(made)

    def job(self, job_id: str) -> Job:
        """Return one job as it is now. Raises `Refused` where there is none."""
        return Job.model_validate(self._transport.get(_path("jobs", job_id)))

    def jobs(self, **conditions: Any) -> Iterator[Job]:
        """Yield jobs, newest first: state, procedure, unit, bench, verdict, since, until, label, text."""
        yield from map(Job.model_validate, self._items("/api/v1/jobs", conditions))

    def wait(
        self, job: Job | str, timeout_s: float | None = None, progress: Callable[[Job], object] | None = None
    ) -> Job:
        """Wait until a job has ended, and return it as it then is, whatever its end.

        `progress` is called with the job whenever it has changed. Raises `TimedOut`; the job then goes on.
        """
        job_id, begun_s = _id(job), time.monotonic()
        look_s, longest_s = LOOKS_S
        before: Job | None = None
        while True:
            now = self.job(job_id)
            if progress is not None and now != before:
                progress(now)
            if now.ended:
                return now
            if timeout_s is not None and time.monotonic() - begun_s > timeout_s:
                raise TimedOut(now, timeout_s)
            look_s = LOOKS_S[0] if now != before else min(1.5 * look_s, longest_s)
            before = now
            time.sleep(look_s)

    def events(self, job: Job | str, after: int = 0) -> Generator[Event]:
        """Yield a job's events from after a sequence until it has ended; lost connections are made again."""
        return follow(self._transport, _id(job), after, self._patience_s)

    def cancel(self, job: Job | str) -> Job:
        """Cancel a job and return it; its recordings are kept. Raises `Refused` where it has ended."""
        return self._ask(job, "cancel")

    def pause(self, job: Job | str) -> Job:
        """Pause a job and return it: a queued one at once, a running one before its next station. Raises `Refused`."""
        return self._ask(job, "pause")

    def resume(self, job: Job | str) -> Job:
        """Queue a paused or interrupted job again and return it; it does the stations that remain. Raises `Refused`."""
        return self._ask(job, "resume")

    def answer(self, job: Job | str, done: bool, remark: str = "") -> Job:
        """Answer the job's prompt to the person at the bench, and return the job. Raises `Refused` where there is
        none.
        """
        return self._ask(job, "answer", {"done": done, "remark": remark})

    def result_of(self, job: Job | str) -> Result:
        """Return the result that gave a job its verdict. Raises `JobEnded` where it ended without one."""
        found = self.job(_id(job))
        if found.ended and found.result is None:
            raise JobEnded(found)
        return result_of_document(self._transport.get(_path("jobs", found.id, "result")))

    def result(self, result_id: str) -> Result:
        """Return one result by its id. Raises `Refused` where there is none."""
        return result_of_document(self._transport.get(_path("results", result_id)))

    def results(self, **conditions: Any) -> Iterator[Result]:
        """Yield results, newest first: unit, name, verdict, since, until, label, text."""
        yield from map(result_of_document, self._items("/api/v1/results", conditions))

    def analyse(
        self,
        method: str,
        recordings: Sequence[str | Recording] = (),
        calibrations: Sequence[str] = (),
        parameters: Mapping[str, Any] | None = None,
        key: str | None = None,
        unit: str | None = None,
    ) -> Result:
        """Run a method on stored recordings or calibrations, wait, and return the result; a method that needs neither
        takes the `unit`'s serial. Raises `Refused`.
        """
        ids = [one.id if isinstance(one, Recording) else one for one in recordings]
        given = {"recordings": ids, "calibrations": list(calibrations), "parameters": dict(parameters or {})}
        given |= {} if unit is None else {"unit": unit}
        return result_of_document(self._transport.post("/api/v1/analyses", key, json={"method": method, **given}))

    def recording(self, recording_id: str) -> Recording:
        """Return a recording without its samples; they are read when they are asked for. Raises `Refused`."""
        return self._recording(self._transport.get(_path("recordings", recording_id)))

    def recordings(self, **conditions: Any) -> Iterator[Recording]:
        """Yield recordings, newest first: job, unit, simulated, verdict, since, until, label, text."""
        yield from map(self._recording, self._items("/api/v1/recordings", conditions))

    def import_files(
        self, files: Sequence[str | Path], description: Mapping[str, Any], key: str | None = None
    ) -> Recording:
        """Import files as one recording and return it. `description` says what is in them: unit, rate, channels with
        their scale. Raises `Refused` naming file and row.
        """
        with ExitStack() as closing:
            opened = [(Path(file).name, closing.enter_context(Path(file).open("rb"))) for file in files]
            parts = [("files", (name, file, "application/octet-stream")) for name, file in opened]
            data = {"description": dumps(description, allow_nan=False)}
            return self._recording(self._transport.post("/api/v1/recordings", key, files=parts, data=data))

    def _recording(self, document: Any) -> Recording:
        return Recording(self._transport, RecordingView.model_validate(document))

    def _ask(self, job: Job | str, what: str, body: dict[str, Any] | None = None) -> Job:
        """Ask something of a job; an answer of another version's job has no more than its state: the job is read."""
        self._transport.post(_path("jobs", _id(job), what), once=False, json=body)
        return self.job(_id(job))

    def _items(self, path: str, conditions: Mapping[str, Any]) -> Iterator[Any]:
        """Yield the items of a list, page by page as they are wanted."""
        query = {**sent(conditions), "limit": PAGE}
        while True:
            page = TypeAdapter(dict[str, Any]).validate_python(self._transport.send("GET", path, params=query).json())
            yield from page["items"]
            if page["next"] is None:
                return
            query["after"] = page["next"]


def _path(*parts: str) -> str:
    return "/api/v1/" + "/".join(quote(part, safe="") for part in parts)


def _id(job: Job | str) -> str:
    return job if isinstance(job, str) else job.id
