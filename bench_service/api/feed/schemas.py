"""Documents of the feed: a bench with the job that drives it, and new events of a job."""

from datetime import datetime

from pydantic import BaseModel, Field

from bench_service.api.benches.schemas import BenchView
from bench_service.api.jobs.schemas import EventView, JobView


class BenchNews(BaseModel):
    """The state of a bench and of the job that drives it; sent at first, and after each change."""

    bench: BenchView = Field(description="Without `live` and `driver_seen_at`, which are sent apart")
    job: JobView | None = Field(description="The job that has begun on it and not ended")


class JobNews(BaseModel):
    """New events of a job that the listener follows, in order."""

    job: str
    events: list[EventView]


class Beat(BaseModel):
    """Heartbeat of the stream: a listener that gets none for three seconds takes the service as gone."""

    at: datetime
    trouble: str | None = Field(description="Why the service cannot read its database now")
