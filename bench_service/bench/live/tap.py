"""Publishes a session's live state: progress, devices, a few samples. Lives in the bench's own thread.

Everything here is bounded: at most one block in `LOOK_S` of real time is looked at, however fast the samples come, and
only the last `STRETCHES` are kept. It reads devices, and commands none.
"""

from collections import deque
from itertools import accumulate

import numpy as np

from bench_service.bench.live.devices import DeviceReadings
from bench_service.bench.live.values import (
    BenchLive,
    LiveBoard,
    LiveChannel,
    LiveDevices,
    LiveJob,
    LiveSamples,
)
from bench_service.model.job import Job
from bench_service.wall_clock import monotonic_s, now
from procedures.bench import Bench
from procedures.bench.errors import BenchError
from procedures.bench.imu import Stream
from procedures.core.arrays import Array
from procedures.core.recording import Channel, NominalScale, RawArray, Station

LOOK_S = 0.1
"""Minimum interval between two blocks that are looked at [s, real time]."""
STRETCHES = 10


class LiveTap:
    """Collects the progress, device readings and last samples of one job's session, and publishes them to the
    `LiveBoard`. Used by the bench's own thread.
    """

    def __init__(self, job: Job, bench: Bench, board: LiveBoard) -> None:
        self._job = job
        self._bench = bench
        self._board = board
        self._shares = _shares(job.stations, job.duration_s)
        self._over = (0.0, *accumulate(self._shares))
        self._index = 0
        self._station_begun_s = self._opened_s = bench.clock.now_s()
        self._opened_at_s = self._looked_at_s = monotonic_s()
        self._channels: tuple[Channel, ...] = ()
        self._rate_hz = 1.0
        self._readings = DeviceReadings(bench)
        self._stretches: deque[tuple[float, float, Array]] = deque(maxlen=STRETCHES)

    def station(self, index: int) -> None:
        """Note that the station with this index (from 0) begins now, for the progress of the job."""
        self._index = index
        self._station_begun_s = self._bench.clock.now_s()

    def stream(self, stream: Stream) -> None:
        """Note that a recording begins: its channels and rate replace those before, and the kept samples are
        dropped.
        """
        self._channels, self._rate_hz = stream.channels, stream.rate_hz
        self._stretches.clear()

    def block(self, start_s: float, block: RawArray) -> None:
        """Take in stored samples, shape (n, channels), of which a few are kept for the plot; `start_s` is the bench
        time of the first one's beginning.
        """
        looked_at_s = monotonic_s()
        if looked_at_s - self._looked_at_s < LOOK_S or len(block) == 0:
            return
        self._looked_at_s = looked_at_s
        found = np.array([block.min(axis=0), block.mean(axis=0), block.max(axis=0)], dtype=np.float64)
        self._stretches.append((start_s, start_s + len(block) / self._rate_hz, found))

    async def publish(self) -> None:
        """Publish the job's progress, the devices' state and the last samples."""
        self._board.publish(
            BenchLive(self._job.bench, now(), job=self._progress(), devices=await self._devices(), samples=self._said())
        )

    def end(self) -> None:
        """Publish that the session is over and the bench idle."""
        self._board.publish(BenchLive(self._job.bench, now()))

    def _progress(self) -> LiveJob:
        bench_time_s = self._bench.clock.now_s()
        into_s = min(max(0.0, bench_time_s - self._station_begun_s), self._shares[self._index])
        done_s = self._over[self._index] + into_s
        left_s = max(0.0, self._job.duration_s - done_s)
        passed_s = bench_time_s - self._opened_s
        rate = passed_s / wall_s if (wall_s := monotonic_s() - self._opened_at_s) > 0.0 else 0.0
        return LiveJob(
            id=self._job.id,
            station=self._index,
            stations=len(self._job.stations),
            label=self._job.stations[self._index].label,
            bench_time_s=bench_time_s,
            fraction=min(1.0, done_s / self._job.duration_s) if self._job.duration_s > 0.0 else 0.0,
            eta_s=left_s,
            eta_wall_s=left_s / rate if rate > 0.0 else None,
            bench_s_per_s=rate if rate > 0.0 else None,
        )

    async def _devices(self) -> LiveDevices | None:
        try:
            return await self._readings.read()
        except BenchError:  # the procedure raises it where it matters
            return None

    def _said(self) -> LiveSamples | None:
        if not self._stretches:
            return None
        starts, stops, found = zip(*self._stretches, strict=True)
        raw = np.array(found)  # (stretches, 3, channels)
        rates = NominalScale.of(self._channels, self._rate_hz).rates(raw)
        channels = tuple(_channel(c, rates[:, :, k]) for k, c in enumerate(self._channels))
        return LiveSamples(starts, stops, channels)


def _channel(channel: Channel, rates: Array) -> LiveChannel:
    """One channel's live values from `rates`, shape (stretches, 3): of the least, the mean and the greatest count."""
    low, mean, high = rates.T
    if channel.scale < 0.0:
        low, high = high, low
    return LiveChannel(channel.name, channel.rate_unit, tuple(low.tolist()), tuple(mean.tolist()), tuple(high.tolist()))


def _shares(stations: tuple[Station, ...], duration_s: float) -> tuple[float, ...]:
    """The planned bench time [s] of each station: its declared durations, plus an equal share of all moves."""
    declared = [s.power_off_s + s.settle_s + s.record_s for s in stations]
    rest = (duration_s - sum(declared)) / len(stations) if stations else 0.0
    if rest >= 0.0:
        return tuple(d + rest for d in declared)
    return tuple(d * duration_s / sum(declared) for d in declared)
