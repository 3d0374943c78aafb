"""Present states of benches: one row each, and what the absence of a word means."""

from datetime import timedelta

from bench_service.bench.live.values import (
    SEEN_S,
    BenchLive,
    Heartbeat,
    LiveBoard,
    LiveChannel,
    LiveDevices,
    LiveJob,
    LiveSamples,
)
from bench_service.campaigns.stores import Stores
from bench_service.wall_clock import monotonic_s, now, pause
from procedures.bench.chamber import ChamberReading
from tests.storage.conftest import NOW

JOB = LiveJob("J-1", 2, 12, "β=0 γ=-90", 512.25, 0.25, 1536.75, 3.5, 439.07)
DEVICES = LiveDevices(0.0, -90.0, 12.5, True, True, ChamberReading(512.25, 20.1, 20.0, None, False, True))
SAMPLES = LiveSamples((1.0, 2.0), (2.0, 3.0), (LiveChannel("gyro_x", "rad/s", (-1e-5, 0.0), (0.0, 1e-9), (1.0, 2.0)),))


def test_a_word_comes_back_as_it_was_and_replaces_the_one_before(stores: Stores) -> None:
    whole = BenchLive("sim", NOW, "bench-pc", 4711, True, JOB, DEVICES, SAMPLES)
    stores.live.put(BenchLive("sim", NOW))
    stores.live.put(whole)
    stores.live.put(BenchLive("annex", NOW))
    assert stores.live.get("sim") == whole
    assert [live.bench for live in stores.live.all()] == ["annex", "sim"]
    assert stores.live.get("none") is None


def test_who_is_silent_for_long_is_not_there(stores: Stores) -> None:
    stores.live.put(BenchLive("sim", NOW, job=JOB))
    board = LiveBoard(stores.live, clock=lambda: NOW + timedelta(seconds=SEEN_S + 1))
    live = board.of_bench("sim")
    assert live is not None
    assert live.there(NOW + timedelta(seconds=SEEN_S))
    assert not live.there(NOW + timedelta(seconds=SEEN_S + 1))


def test_a_driver_beats_while_it_is_there_and_says_when_it_ends(stores: Stores) -> None:
    board = LiveBoard(stores.live, "sim")
    heart = Heartbeat(board, stores.live)
    heart.begin()
    board.publish(BenchLive("sim", now(), job=JOB))
    deadline = monotonic_s() + 10
    while (live := stores.live.get("sim")) is None or live.job != JOB:
        assert monotonic_s() < deadline
        pause(0.02)
    assert live.process > 0
    heart.end()
    live = stores.live.get("sim")
    assert live is not None
    assert (live.driving, live.job, live.there(now())) == (False, None, False)
