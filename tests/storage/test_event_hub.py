"""The hub of listeners over a real database: order, no gap, no double, and the slow one let go alone."""

import asyncio
from collections.abc import Callable, Iterator

import pytest

from bench_service.api.jobs.event_stream import FRAMES
from bench_service.bench.live.values import LiveBoard
from bench_service.campaigns.stores import Stores
from bench_service.jobs.events import hub
from bench_service.jobs.events.hub import WATCH_S, EventHub
from bench_service.model.errors import NotFound
from bench_service.model.job import Job, JobState
from bench_service.persistence import open_stores
from bench_service.wall_clock import monotonic_s, now

LAG, RECENT = 20, 30


@pytest.fixture
def elsewhere(database_url: str) -> Iterator[Stores]:
    """The same database from a process that our hub knows nothing of."""
    stores, database = open_stores(database_url)
    yield stores
    database.dispose()


def ids(pieces: list[bytes]) -> list[int]:
    return [int(line.removeprefix(b"id: ")) for line in b"".join(pieces).split(b"\n") if line.startswith(b"id: ")]


async def note(stores: Stores, job: Job, count: int = 1) -> None:
    for number in range(count):
        await asyncio.to_thread(stores.jobs.note, job.id, "note", now(), {"number": number})


def test_who_does_not_read_is_let_go_alone_and_comes_back_without_a_gap(
    stores: Stores, new_job: Callable[..., Job]
) -> None:
    """Here, not over HTTP: a socket's buffers would hide for megabytes who reads and who does not."""
    job = stores.jobs.add(new_job())

    async def scene() -> None:
        hub = EventHub(stores.jobs, LiveBoard(stores.live), FRAMES, LAG, RECENT)
        slow, quick = hub.follow(job.id, 0), hub.follow(job.id, 0)
        heard = [await anext(quick)]
        assert await anext(slow) == heard[0]
        for _ in range(LAG + 20):
            await note(stores, job)
            heard.append(await anext(quick))
        assert ids(heard) == list(range(1, LAG + 22))
        assert (hub.dropped, hub.listeners) == (1, 1)
        assert [frame async for frame in slow] == [FRAMES.dropped]
        again = hub.follow(job.id, 1)
        assert [await anext(again) for _ in range(LAG + 20)] == heard[1:]
        await quick.aclose()
        await again.aclose()
        assert hub.listeners == 0

    asyncio.run(scene())


@pytest.mark.parametrize("after", [0, 7, RECENT + 50, RECENT + 101, 2**31])
def test_a_newcomer_hears_all_that_came_after_and_then_what_comes(
    stores: Stores, new_job: Callable[..., Job], after: int
) -> None:
    job = stores.jobs.add(new_job())

    async def scene() -> None:
        hub = EventHub(stores.jobs, LiveBoard(stores.live), FRAMES, LAG, RECENT)
        await note(stores, job, 50)
        first = hub.follow(job.id, 50)
        await anext(first)
        following = asyncio.create_task(anext(first))  # the job is watched from here on
        await note(stores, job, RECENT + 50)
        await following
        late = hub.follow(job.id, after)
        heard = [await anext(late) for _ in range(max(0, RECENT + 101 - after))]
        stores.jobs.request_cancel(job.id, now())
        heard += [frame async for frame in late]
        assert ids(heard) == list(range(after + 1, RECENT + 104))
        await first.aclose()

    asyncio.run(scene())


def test_events_of_this_process_come_at_once_and_of_another_one_with_the_next_look(
    stores: Stores, elsewhere: Stores, new_job: Callable[..., Job], monkeypatch: pytest.MonkeyPatch
) -> None:
    """At once: although the next look is an hour away, however slow this machine is."""
    job = stores.jobs.add(new_job())

    async def scene() -> None:
        hub = EventHub(stores.jobs, LiveBoard(stores.live), FRAMES, LAG, RECENT)
        listener = hub.follow(job.id, 0)
        await anext(listener)
        for _ in range(12):
            waiting = asyncio.create_task(anext(listener))
            await note(stores, job)
            await asyncio.wait_for(waiting, 30)
        waiting = asyncio.create_task(anext(listener))
        await note(elsewhere, job)
        await asyncio.sleep(2 * WATCH_S)
        assert not waiting.done(), "who told it of what another process did?"
        await note(stores, job)
        await asyncio.wait_for(waiting, 30)
        await listener.aclose()

    async def looks() -> float:
        """The least of twelve times from an event in another process to its coming [s]."""
        hub = EventHub(stores.jobs, LiveBoard(stores.live), FRAMES, LAG, RECENT)
        listener = hub.follow(job.id, stores.jobs.last_event(job.id)[0] - 1)
        await anext(listener)
        took: list[float] = []
        for _ in range(12):
            waiting = asyncio.create_task(anext(listener))
            await note(elsewhere, job)
            begun = monotonic_s()
            await asyncio.wait_for(waiting, 30)
            took.append(monotonic_s() - begun)
        await listener.aclose()
        return min(took)

    with monkeypatch.context() as patched:
        patched.setattr(hub, "WATCH_S", 3600.0)
        asyncio.run(scene())
    assert asyncio.run(looks()) < 2 * WATCH_S


def test_a_stream_ends_with_the_job_and_goes_on_after_a_resume(stores: Stores, new_job: Callable[..., Job]) -> None:
    job = stores.jobs.add(new_job())

    async def all_of(hub: EventHub, after: int) -> list[int]:
        return ids([frame async for frame in hub.follow(job.id, after)])

    async def scene() -> None:
        hub = EventHub(stores.jobs, LiveBoard(stores.live), FRAMES, LAG, RECENT)
        with pytest.raises(NotFound):
            await hub.require("none")
        stores.jobs.transition(job.id, JobState.INTERRUPTED, at=now())
        assert await all_of(hub, 0) == [1, 2]
        assert await all_of(hub, 2) == []
        stores.jobs.resume(job.id, now())
        rest = asyncio.create_task(all_of(hub, 0))
        await note(stores, job)
        await asyncio.to_thread(stores.jobs.request_cancel, job.id, now())
        assert await rest == [1, 2, 3, 4, 5, 6]
        assert await all_of(hub, 5) == [6]
        assert hub.listeners == 0

    asyncio.run(scene())
