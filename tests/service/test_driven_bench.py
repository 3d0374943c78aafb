"""A stop at any moment of a job's work: once it has returned, the work gives no further demand to a device."""

import sys
from collections.abc import Generator
from contextlib import suppress
from threading import Thread

import pytest

from bench_service.bench.driven import DrivenBench
from procedures.bench.errors import Stopped
from simulators.world import WorldConfig, build

ROUNDS = 200
"""Stops; without the lock that begins and stops share, one in thirty found work that began after it."""


class Worker(DrivenBench):
    """Looks at the table again and again, as a procedure does, and counts its looks."""

    def __init__(self) -> None:
        super().__init__("a job", build(WorldConfig()), lambda: False)
        self.looks = 0

    def work(self) -> None:
        with suppress(Stopped):
            while True:
                self._run(self._look())

    async def _look(self) -> None:
        self.looks += 1
        await self._bench.turntable.read()
        self.looks += 1


@pytest.fixture
def hasty() -> Generator[None]:
    """Threads hand over as often as they can."""
    before = sys.getswitchinterval()
    sys.setswitchinterval(1e-6)
    yield
    sys.setswitchinterval(before)


@pytest.mark.usefixtures("hasty")
def test_no_work_begins_after_a_stop() -> None:
    late = 0
    for _ in range(ROUNDS):
        worker = Worker()
        job = Thread(target=worker.work)
        job.start()
        while not worker.looks:
            pass
        worker.stop()
        looks = worker.looks
        worker.make_safe()
        job.join(10)
        assert not job.is_alive()
        late += worker.looks != looks
        worker.close()
    assert late == 0


def test_a_stop_that_comes_after_the_session_has_ended_has_nothing_to_leave() -> None:
    worker = Worker()
    job = Thread(target=worker.work)
    job.start()
    while (under_way := worker._under_way) is None:
        pass
    worker.stop()
    job.join(10)
    worker.make_safe()
    worker.close()
    worker._under_way = under_way  # as a stop reads it that comes while the session ends
    worker.stop()


class Careless(Worker):
    """Its procedure fails while it is left."""

    async def _leave(self) -> None:
        raise ValueError("cannot divide")


def test_a_defect_in_a_procedures_ending_does_not_keep_the_devices_from_being_safe(
    caplog: pytest.LogCaptureFixture,
) -> None:
    worker = Careless()
    worker.make_safe()
    worker.close()
    assert "a job: its procedure's step could not be left in order" in caplog.text
    assert "cannot divide" in caplog.text
