"""Promises of the unit's data link, for every implementation of it."""

import asyncio
from collections.abc import AsyncIterator
from pathlib import Path

import numpy as np
import pytest

from bench_service.drivers.devices.unit_recordings import UnitRecordings
from bench_service.drivers.link.frame_stream import Tape
from procedures.bench.errors import BenchError, DeviceFault, Disconnected, NotPowered
from simulators.served.faults import Fault
from tests.conformance.served import opened
from tests.conformance.units import IMPLEMENTATIONS, UnitRig, unit

STREAMS = ("framed", "ixcom")


async def _record(rig: UnitRig, seconds: float) -> np.ndarray:
    blocks = [block async for block in rig.port.record(seconds).blocks]
    return np.concatenate(blocks) if blocks else np.empty((0, 6), dtype=np.int32)


async def _drain(blocks: AsyncIterator[np.ndarray]) -> None:
    async for _ in blocks:
        continue


async def _ready(rig: UnitRig) -> None:
    """Switch on and wait until the data are valid."""
    rig.power(True)
    await rig.clock.sleep(2.0)
    if isinstance(rig.port, UnitRecordings):  # a busy machine may take longer than that
        await rig.port.ready()


@pytest.fixture(params=IMPLEMENTATIONS)
def rig(request: pytest.FixtureRequest, tmp_path: Path):
    with unit(request.param, tmp_path) as made:
        yield made


def test_a_recording_has_exactly_its_samples_and_the_units_own_counts(rig: UnitRig) -> None:
    async def scene() -> None:
        tape = rig.listen()  # before anything is sent: frames on their way are among those that were made
        await _ready(rig)
        found = await _record(rig, 5.0)
        assert found.shape == (2000, 6)
        assert found.dtype == np.int32
        assert await _record(rig, 0.0) is not None
        made = np.concatenate(list(tape.blocks))
        places = [k for k in range(len(made) - len(found) + 1) if np.array_equal(made[k], found[0])]
        assert any(np.array_equal(made[k : k + len(found)], found) for k in places), "counts are those that were made"

    asyncio.run(scene())


def test_a_unit_without_power_sends_nothing(rig: UnitRig) -> None:
    async def scene() -> None:
        with pytest.raises(NotPowered):
            await _record(rig, 1.0)
        await _ready(rig)
        await _record(rig, 1.0)
        rig.power(False)
        with pytest.raises(NotPowered):
            await _record(rig, 1.0)
        await _ready(rig)
        assert len(await _record(rig, 1.0)) == 400

    asyncio.run(scene())


def test_power_that_goes_during_a_recording_ends_it(rig: UnitRig) -> None:
    async def scene() -> None:
        await _ready(rig)
        blocks = rig.port.record(600.0).blocks
        await anext(blocks)
        rig.power(False)
        with pytest.raises(NotPowered):
            await _drain(blocks)

    asyncio.run(scene())


@pytest.mark.parametrize("name", STREAMS)
def test_data_that_are_not_valid_yet_are_refused(tmp_path: Path, name: str) -> None:
    async def scene(rig: UnitRig) -> None:
        rig.power(True)
        with pytest.raises(DeviceFault, match=r"says that its data are not valid, in frame \d+: .*status 0x"):
            await _record(rig, 1.0)
        assert any(word.bits for word in rig.port.status())

    with unit(name, tmp_path, valid_after_s=60.0) as rig:
        asyncio.run(scene(rig))


@pytest.mark.parametrize(
    ("kind", "words"),
    [
        ("lost_counter", r"1 frames were lost: after counter \d+ came \d+"),
        ("wrong_crc", r"1 frames were lost: after counter \d+ came \d+ \(a frame in between was damaged\)"),
        ("half", r"were? lost: after counter \d+ came \d+ \(a frame in between was damaged\)"),
        ("doubled", r"a frame came twice: counter \d+"),
        ("invalid", r"data are not valid, in frame \d+"),
    ],
)
@pytest.mark.parametrize("name", STREAMS)
def test_a_frame_that_is_lost_is_named_with_its_counter(tmp_path: Path, name: str, kind: str, words: str) -> None:
    async def scene(rig: UnitRig) -> None:
        await _ready(rig)
        blocks = rig.port.record(60.0).blocks
        await anext(blocks)
        sent = rig.behind.do(lambda bench: bench.plan.sent["unit_link"])
        rig.behind.do(lambda bench: setattr(bench.plan, "faults", (Fault("unit_link", kind, at=sent + 900),)))
        with pytest.raises(BenchError, match=words):
            await _drain(blocks)
        rig.behind.plan()
        assert len(await _record(rig, 1.0)) == 400

    with unit(name, tmp_path) as rig:
        asyncio.run(scene(rig))


@pytest.mark.parametrize("name", STREAMS)
def test_a_counter_that_wraps_round_loses_nothing(tmp_path: Path, name: str) -> None:
    async def scene(rig: UnitRig) -> None:
        await _ready(rig)
        if name == "framed":
            imu_streams = rig.behind.do(lambda bench: bench.bench.imu._tapes.running)
            rig.behind.do(lambda bench: setattr(imu_streams[0], "counter", 65_000))
            await rig.clock.sleep(1.0)
        # 2000 frames: an 8-bit counter wraps seven times, the 16-bit one once.
        assert len(await _record(rig, 5.0)) == 2000

    with unit(name, tmp_path) as rig:
        asyncio.run(scene(rig))


@pytest.mark.parametrize("name", STREAMS)
def test_a_cut_line_ends_the_recording_and_the_next_one_has_a_new_line(tmp_path: Path, name: str) -> None:
    async def scene(rig: UnitRig) -> None:
        await _ready(rig)
        blocks = rig.port.record(600.0).blocks
        await anext(blocks)
        rig.behind.do(lambda bench: bench.ports["unit_link"].cut())
        with pytest.raises(Disconnected, match=r"the unit link at tcp://127\.0\.0\.1:\d+ is cut: "):
            await _drain(blocks)
        assert len(await _record(rig, 1.0)) == 400

    with unit(name, tmp_path, section={"answer_s": 2.0}) as rig:
        asyncio.run(scene(rig))


def test_silence_is_told_by_its_deadline(tmp_path: Path) -> None:
    async def scene(rig: UnitRig) -> None:
        await _ready(rig)
        await _record(rig, 1.0)
        rig.behind.do(lambda bench: bench.ports["unit_link"].cut())
        with pytest.raises(Disconnected, match=r"sent nothing for 0\.3 s"):
            await _record(rig, 10.0)

    with unit("datagrams", tmp_path, section={"answer_s": 0.3}) as rig:
        asyncio.run(scene(rig))


@pytest.mark.parametrize("name", STREAMS)
def test_a_recording_that_is_cancelled_leaves_the_link_usable(tmp_path: Path, name: str) -> None:
    async def scene(rig: UnitRig) -> None:
        await _ready(rig)
        for pause_s in (0.0, 0.005, 0.05):
            recording = asyncio.create_task(_record(rig, 60.0))
            await asyncio.sleep(pause_s)
            recording.cancel()
            await asyncio.wait([recording])
            assert recording.cancelled()
        assert len(await _record(rig, 1.0)) == 400

    with unit(name, tmp_path) as rig:
        asyncio.run(scene(rig))


def test_a_second_master_of_an_ixcom_channel_is_refused(tmp_path: Path) -> None:
    async def scene(rig: UnitRig) -> None:
        await _ready(rig)
        await _record(rig, 1.0)
        other = opened("unit_link", "ixcom", rig.behind.numbers["unit_link"], tmp_path)
        with pytest.raises(Disconnected, match=r"invalid channel \(code 8\)"):
            await other.connect()
        other.close()

    with unit("ixcom", tmp_path) as rig:
        asyncio.run(scene(rig))


@pytest.mark.parametrize(
    ("now_s", "left_out"), [(10.0, 8), (10.001, 8), (10.0013, 7), (10.006, 6), (10.0199, 0), (10.5, 0), (9.9, 8)]
)
def test_frames_of_samples_before_the_begin_are_left_out(now_s: float, left_out: int) -> None:
    """Eight frames came together, one each 2.5 ms, the newest at `now_s`: those from 10 s on are kept."""
    tape = Tape(1000, begin_s=10.0, interval_s=0.0025)
    assert tape.before(8, now_s) == left_out
    tape.begun = True
    assert tape.before(8, now_s) == 0
    assert Tape(1000).before(8, now_s) == 0
