"""The trend of a unit's noise in a printed report: the result's own launches and older ones, whatever follows."""

from collections.abc import Callable

import pytest

from bench_service.campaigns.stores import Stores
from bench_service.evidence.reports import noise_parts
from bench_service.model.job import Job
from bench_service.model.records import StoredResult


@pytest.fixture
def launched(
    stores: Stores, new_job: Callable[..., Job], new_result: Callable[..., StoredResult]
) -> Callable[..., StoredResult]:
    """A result of static launches, whose quantization of the x gyro is `mean`."""

    def make(mean: float, job: Job | None = None, simulated: bool = True) -> StoredResult:
        means = [{"process": "quantization", "mean": mean, "sd": 0.0}]
        job = job or stores.jobs.add(new_job())
        document = {"channels": [{"channel": "gyro_x", "means": means}]}
        return stores.results.add(new_result(job_id=job.id, document=document, simulated=simulated))

    return make


def points(stores: Stores, newest: StoredResult | None = None) -> list[float]:
    """Values of the trend, in units of the first launch."""
    unit = noise_parts.NOISE_DISPLAY["rad/s"]["quantization"][1]
    return [
        round(float(y) * unit)
        for figure in noise_parts.noise_trends(stores, "U-1", True, newest)
        for series in figure.series
        for y in series.y
    ]


def test_a_result_with_many_newer_ones_has_its_trend(
    stores: Stores, new_job: Callable[..., Job], launched: Callable[..., StoredResult]
) -> None:
    job = stores.jobs.add(new_job())
    launched(1.0)
    launched(2.0, job)  # an older analysis, which the newer one stands for
    for number in range(noise_parts.NOISE_RESULTS):
        launched(100.0 + number, simulated=False)
    mine = launched(3.0, job)
    for number in range(noise_parts.NOISE_RESULTS + 1):
        launched(10.0 + number)
    assert points(stores, mine) == [1, 3]
    assert points(stores) == [10 + number for number in range(1, noise_parts.NOISE_RESULTS + 1)]
