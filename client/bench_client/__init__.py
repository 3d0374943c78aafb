"""Client of a bench service: submit jobs, wait for them, read results as objects and samples as arrays.

    from bench_client import Client

    with Client("http://127.0.0.1:8000") as client:
        job = client.submit("calibration_12_orientations", unit="SIM-0001", parameters={"dwell_s": 30.0})
        job = client.wait(job, progress=lambda job: print(job.progress.fraction))
        result = client.result_of(job)
        rates = client.recording(result.lineage.recordings[0].id).rates()

Every answer of the service is an object; an error is an exception with the service's own sentence and fields.
"""

from bench_client.client import Client
from bench_client.recording import Recording
from bench_client.refusals import BenchClientError, JobEnded, Refused, TimedOut, Unavailable
from bench_client.samples import Samples
from bench_client.views import Channel, Event, Job, Preview, Problem

__all__ = [
    "BenchClientError",
    "Channel",
    "Client",
    "Event",
    "Job",
    "JobEnded",
    "Preview",
    "Problem",
    "Recording",
    "Refused",
    "Samples",
    "TimedOut",
    "Unavailable",
]
