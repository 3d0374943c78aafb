"""A bench while a job drives it: the stations of one job, recorded in order."""

import asyncio
from collections.abc import AsyncIterator, Callable
from contextlib import aclosing

from bench_service.bench.device_log import DeviceLog, made_by
from bench_service.bench.driven import DrivenBench
from bench_service.bench.live.tap import LiveTap
from bench_service.bench.live.values import PUBLISH_S
from bench_service.bench.streams import opened, require_end, stream_of
from bench_service.evidence.recordings import RecordingStore
from bench_service.model.job import Job
from bench_service.model.records import NewRecording
from procedures.bench import Bench
from procedures.bench.imu import Stream
from procedures.core.recording import RecordingInfo, Station
from procedures.procedure import Outcome, Parameters, Procedure


class BenchSession(DrivenBench):
    """Drives one job's stations in order. `record` may begin at any of them: the procedure is opened there.

    `stop_wanted` is called every `STOP_CHECK_S` of real time; True raises `Stopped` in the procedure's step under way.
    """

    def __init__(
        self,
        job: Job,
        procedure: Procedure[Parameters, Outcome],
        bench: Bench,
        recordings: RecordingStore,
        stop_wanted: Callable[[], bool],
        tap: LiveTap | None = None,
        stop_stands: Callable[[], bool] = lambda: False,
    ) -> None:
        super().__init__(f"job {job.id}", bench, stop_wanted, stop_stands)
        self.job = job
        self._procedure = procedure
        self._recordings = recordings
        self._streams: AsyncIterator[Stream] | None = None
        self._next = -1
        self._tap = tap
        self._telling: asyncio.TimerHandle | None = None
        self._told: asyncio.Task[None] | None = None

    def record(self, index: int) -> RecordingInfo:
        """Record one station and store it. Raises `BenchError`, `ProcedureDefect`, `StorageFull`,
        `StorageFailure`, `ShuttingDown`.

        A device that does not answer is `Disconnected`, whatever its driver's own error handling does.
        """
        return self._run(self._record(index))

    async def _record(self, index: int) -> RecordingInfo:
        station = self.job.stations[index]
        if self._tap is not None:
            self._tap.station(index)
            if self._telling is None:
                self._tell(self._tap)
        if self._streams is None or self._next != index:
            await self._close_streams()
            self._streams = opened(self._procedure, self._bench, self.job.stations[index:])
        stream = await stream_of(self._streams, self._procedure.name, station)
        info = await self._store(stream, station)
        self._next = index + 1
        if self._next == len(self.job.stations):
            await require_end(self._streams, self._procedure.name, self.job.stations)
        return info

    async def _store(self, stream: Stream, station: Station) -> RecordingInfo:
        writer = self._recordings.open(
            NewRecording(
                unit=self.job.unit,
                channels=stream.channels,
                rate_hz=stream.rate_hz,
                start_s=stream.start_s,
                simulated=self.job.simulated,
                job_id=self.job.id,
                bench=self.job.bench,
                station=station,
                launched_s=stream.launched_s,
                source=made_by(self._bench.description),
            )
        )
        tap, begins_s = self._tap, stream.start_s
        devices, samples = DeviceLog(self._bench, station, stream.start_s), 0
        if tap is not None:
            tap.stream(stream)
        try:
            async for block in stream.blocks:
                samples += len(block)
                devices.block(samples / stream.rate_hz)
                writer.write(block)
                await devices.look()
                if tap is not None:
                    tap.block(begins_s, block)
                    begins_s += len(block) / stream.rate_hz
                await asyncio.sleep(0)  # noqa: TID251  lets a cancel land; no time passes
            return writer.seal(self._bench.checkpoint(), devices.measured())
        except BaseException:
            writer.abandon()
            raise

    async def _leave(self) -> None:
        await self._close_streams()

    async def _end(self) -> None:
        if self._tap is not None:
            await self._stop_telling(self._tap)

    async def _close_streams(self) -> None:
        if self._streams is not None and hasattr(self._streams, "aclose"):
            async with aclosing(self._streams):  # pyright: ignore[reportArgumentType]  an async generator
                pass
        self._streams = None

    def _tell(self, tap: LiveTap) -> None:
        """Publish the live state, now and every `PUBLISH_S`: between two steps of the procedure, in their thread."""
        if self._told is None or self._told.done():
            self._told = self._loop.create_task(tap.publish())
        self._telling = self._loop.call_later(PUBLISH_S, self._tell, tap)

    async def _stop_telling(self, tap: LiveTap) -> None:
        if self._telling is not None:
            self._telling.cancel()
        if self._told is not None:
            self._told.cancel()
            await asyncio.wait([self._told])
        tap.end()
