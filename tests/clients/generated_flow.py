"""A service from a preview to an analysis, with nothing but a client that openapi-python-client generated.

``python generated_flow.py ADDRESS``, in an environment that has the generated package `bench_generated`. It says what
it did; an assertion that does not hold ends it.
"""

import sys
import time
from io import BytesIO
from typing import Any, TypeVar

from bench_generated import Client
from bench_generated.api.analyses import list_results, run_method
from bench_generated.api.jobs import list_jobs, read_job, read_result, submit
from bench_generated.api.procedures import list_procedures, preview
from bench_generated.api.recordings import import_recording, list_recordings, read_data
from bench_generated.api.units import list_calibrations, read_unit
from bench_generated.models import (
    AllanDeviationResult,
    AnalysisSubmission,
    Calibration12OrientationsResult,
    ExportFormat,
    ImportDescription,
    JobSubmission,
    PreviewRequest,
    Problem,
    RecordingUpload,
)
from bench_generated.types import File

T = TypeVar("T")
PROCEDURE, UNIT = "calibration_12_orientations", "SIM-0001"
FAST = {"dwell_s": 5.0, "settle_s": 0.5}
ROWS = 4000


def good(answer: "T | Problem | None") -> T:
    """Require an answer that is no problem document."""
    assert answer is not None
    assert not isinstance(answer, Problem), answer
    return answer


def calibrated(client: Client) -> Any:
    """Preview, submit twice with one key, wait: the job at its end."""
    plan = PreviewRequest.from_dict({"unit": UNIT, "parameters": FAST})
    assert len(good(preview.sync(PROCEDURE, client=client, body=plan)).stations) == 12
    body = JobSubmission.from_dict({"procedure": PROCEDURE, "unit": UNIT, "parameters": FAST, "labels": {"lot": "7"}})
    made = [good(submit.sync(client=client, body=body, idempotency_key="flow")) for _ in range(2)]
    assert made[0].id == made[1].id
    until = time.monotonic() + 120
    while (job := good(read_job.sync(made[0].id, client=client))).state in ("queued", "running"):
        assert time.monotonic() < until, job
        time.sleep(0.1)
    assert job.state == "succeeded", job
    assert [one.id for one in good(list_jobs.sync(client=client, label=["lot=7"])).items] == [job.id]
    return job


def imported(client: Client) -> Any:
    """Import a file of text: the recording."""
    rows = "\n".join(["rate", *(f"{1e-3 * ((37 * k) % 101 - 50):.6g}" for k in range(ROWS))])
    channel = {"name": "gyro_x", "quantity": "angular_rate", "unit": "rad/s", "column": "rate"}
    description = ImportDescription.from_dict({"unit": "HAND-2", "rate_hz": 100.0, "channels": [channel]})
    file = File(payload=BytesIO(rows.encode()), file_name="hand.csv", mime_type="text/csv")
    made = good(import_recording.sync(client=client, body=RecordingUpload(files=[file], description=description)))
    assert (made.count, made.channels[0].name) == (ROWS, "gyro_x")
    return made


def main(address: str) -> None:
    with Client(base_url=address, timeout=120) as client:
        procedures = good(list_procedures.sync(client=client))
        job = calibrated(client)
        result = good(read_result.sync(job.id, client=client))
        assert isinstance(result, Calibration12OrientationsResult), type(result)
        assert len(result.document.triads[0].calibration.matrix) == 3
        found = good(list_results.sync(client=client, name=PROCEDURE)).items
        assert [type(one) for one in found] == [Calibration12OrientationsResult]
        recordings = good(list_recordings.sync(client=client, job=job.id)).items
        assert len(recordings) == 12
        data = good(read_data.sync(recordings[0].id, client=client, format_=ExportFormat.NPY))
        raw = data.payload.read()
        assert raw[:6] == b"\x93NUMPY"
        assert len(raw) > 4 * recordings[0].count * len(recordings[0].channels)
        assert good(read_unit.sync(UNIT, client=client)).serial == UNIT
        assert len(good(list_calibrations.sync(UNIT, client=client)).items) >= 1
        wanted = AnalysisSubmission.from_dict({"method": "allan_deviation", "recordings": [imported(client).id]})
        analysis = good(run_method.sync(client=client, body=wanted))
        assert isinstance(analysis, AllanDeviationResult), type(analysis)
        refused = submit.sync(client=client, body=JobSubmission.from_dict({"procedure": PROCEDURE, "unit": "none"}))
        assert isinstance(refused, Problem), refused
        assert refused.status == 422
        print(
            f"{len(procedures)} procedures; a job, its result of type {type(result).__name__}, {len(recordings)} "
            f"recordings, {len(raw)} bytes of one, an import, an analysis and a refusal came as objects"
        )


if __name__ == "__main__":
    main(sys.argv[1])
