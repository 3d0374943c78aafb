"""One job for a terminal: what it is, how it stands, and what a person may have to do."""

import json
from typing import Any

from rich.table import Table
from rich.text import Text

from bench_service.cli.printing.moments import moment


def job_view(job: dict[str, Any]) -> Table:
    """Return the table of a job, a fact a row; facts that it does not have are left out."""
    done, place, prompt, failure = job["progress"], job["queue"], job["prompt"], job["error"]
    left_s = done["eta_s"]
    rows = {
        "job": f"#{job['number']}, {job['id']}",
        "procedure": f"{job['procedure']} {job['procedure_version']}",
        "unit": f"{job['unit']} on bench {job['bench']}",
        "state": state_of(job),
        "verdict": job["verdict"],
        "stations": f"{done['station']} of {done['stations']}" + (f", {done['label']}" if done["label"] else ""),
        "bench time left": None if left_s is None else f"{left_s / 3600:.2f} h",
        "place in the queue": None if place is None else f"{place['position']}, behind {place['ahead']}",
        "waiting": job["waiting"],
        "asks": None if prompt is None else f"{prompt['text']} (`bench job answer {job['id']} --done`)",
        "failure": None if failure is None else f"{failure['kind']}: {failure['message']}",
        "can be resumed": f"`bench job resume {job['id']}`" if job["resumable"] else None,
        "labels": ", ".join(f"{name}={value}" for name, value in job["labels"].items()),
        "requested by": job["requested_by"],
        "parameters": json.dumps(job["requested_parameters"], ensure_ascii=False),
        "submitted": moment(job["created_at"]),
        "finished": None if job["finished_at"] is None else moment(job["finished_at"]),
        "result": job["result"],
    }
    table = Table(show_header=False)
    for name, value in rows.items():
        if value:
            table.add_row(name, Text(str(value)))
    return table


def state_of(job: dict[str, Any]) -> str:
    """Return the state of a job as text, and whether it is about to change."""
    leaves = job["state"] == "running" and job.get("pause_requested")
    return f"{job['state']}, to be paused before its next station" if leaves else job["state"]
