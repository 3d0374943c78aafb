"""A bench while an operator drives it: demands as they come, readings meanwhile, and one end at which it is left."""

import asyncio
import logging
from collections.abc import Callable
from contextlib import suppress
from math import inf

from bench_service.bench.driven import STOPPED, UNWIND_S, DrivenBench
from bench_service.bench.live.devices import DeviceReadings
from bench_service.bench.live.values import PUBLISH_S, BenchLive, LiveBoard, LiveManual
from bench_service.jobs.manual.sensors import UnitReadings
from bench_service.jobs.manual.work import TICK_S, DemandWork
from bench_service.model.manual import MOTIONS, Answer, DemandState, ManualDemand, ManualLease
from bench_service.wall_clock import monotonic_at_s, monotonic_s, now, pause_async
from procedures.bench import Bench
from procedures.bench.errors import BenchError, Disconnected, OutOfRange, Stopped
from procedures.core.errors import BadParameter

TIME_OVER, LEFT = "its time has ended", "the bench is being made safe"

log = logging.getLogger(__name__)
Tell = Callable[[ManualDemand, DemandState, Answer], object]


class ManualSession(DrivenBench):
    """Carries out demands until `leave`, a stop, or the end of the lease's time, which depends on no database.

    Demands begin in the bench's loop. `_leave` ends that and cancels what is under way in one step of it, before any
    device is made safe: no demand is carried out during or after the way to safety.
    """

    def __init__(
        self,
        lease: ManualLease,
        bench: Bench,
        stop_wanted: Callable[[], bool],
        board: LiveBoard,
        tell: Tell,
        stop_stands: Callable[[], bool] = lambda: False,
    ) -> None:
        """Set up with `tell`, called in the bench's thread with what becomes of a demand; it must not wait."""
        super().__init__(f"manual lease {lease.id}", bench, stop_wanted, stop_stands)
        self.lease = lease
        self._board, self._tell = board, tell
        self._readings = DeviceReadings(self._bench)
        self._sensors = UnitReadings(bench)
        self._work = DemandWork(self._bench, self._sensors, self._leave_motion)
        self._over = asyncio.Event()
        self._until_s = monotonic_at_s(lease.until)
        self._publish_s = -inf
        self._ended_because = ""
        """The reason why no demand begins any more; empty: demands begin."""
        self._seen: set[str] = set()
        self._begun: set[str] = set()
        self._tasks: dict[asyncio.Task[None], ManualDemand] = {}
        """Demands under way, by their tasks."""
        self._failure: BenchError | None = None

    def hold(self) -> None:
        """Hold the bench and block until the lease ends. Raises `Stopped`, `Disconnected`, `ShuttingDown`,
        `StorageFailure`.
        """
        self._run(self._life())

    def leave(self, because: str) -> None:
        """Make `hold` return, and begin no demand any more; from any thread, also once the session is closed."""
        self._end_demands(because)
        with suppress(RuntimeError):  # the loop of a closed session
            self._loop.call_soon_threadsafe(self._over.set)

    def stop(self) -> None:
        """Stop as any driven bench; no demand begins from here on."""
        self._end_demands(STOPPED)
        super().stop()

    def shut_down(self) -> None:
        """Shut down as any driven bench; no demand begins from here on."""
        self._end_demands("the service ended")
        super().shut_down()

    def make_safe(self) -> None:
        """Make safe as any driven bench; no demand begins from here on, also where its thread does not come back."""
        self._end_demands(LEFT)
        super().make_safe()

    def _end_demands(self, because: str) -> None:
        """Begin no demand from here on; the first reason stays. From any thread."""
        self._ended_because = self._ended_because or because

    def expires(self, lease: ManualLease) -> None:
        """Take over the lease's end where it was moved, by a clock that is never set back; from any thread."""
        if lease.until != self.lease.until:
            self._until_s = monotonic_at_s(lease.until)
            self.lease = lease

    def demand(self, demand: ManualDemand) -> None:
        """Carry out a demand, unless it was given before or demands have ended. From any thread."""
        try:
            self._loop.call_soon_threadsafe(self._begin, demand)
        except RuntimeError:  # the loop of a closed session
            self._not_begun(demand)

    @property
    def expired(self) -> bool:
        """True once the lease's time is over, by the monotonic clock."""
        return monotonic_s() >= self._until_s

    async def _life(self) -> None:
        try:
            while not self._over.is_set() and not self.expired:
                await self._pass()
                if self._failure is not None:
                    raise self._failure
                if monotonic_s() >= self._publish_s:
                    self._publish_s = monotonic_s() + PUBLISH_S
                    await self._publish()
            self._end_demands(TIME_OVER)
        except BenchError as failure:
            self._end_demands(str(failure))
            raise
        finally:
            await self._leave()

    async def _leave(self) -> None:
        """End demands and cancel what is under way: nothing is carried on while the devices are made safe."""
        self._end_demands(LEFT)
        for task in self._tasks:
            task.cancel()
        if self._tasks:
            _, left = await asyncio.wait([*self._tasks], timeout=UNWIND_S)
            if left:
                log.error("%s: %d demands could not be left within %g s", self._name, len(left), UNWIND_S)

    async def _end(self) -> None:
        await self._leave()  # before the devices' links are given back
        self._board.publish(BenchLive(self.lease.bench, now()))

    async def _pass(self) -> None:
        """Let some time pass, in the bench's clock unless a motion does that already."""
        if self._motion() is not None:
            await pause_async(TICK_S)
        else:
            await self._work.time_passes(TICK_S)

    def _motion(self) -> asyncio.Task[None] | None:
        """The motion under way; there is one at most."""
        return next((task for task, one in self._tasks.items() if one.kind in MOTIONS and not task.done()), None)

    async def _leave_motion(self) -> None:
        """Leave the motion under way, for a halt; it is waited for no longer than work takes to unwind."""
        if (motion := self._motion()) is not None:
            motion.cancel()
            await asyncio.wait([motion], timeout=UNWIND_S)

    async def _publish(self) -> None:
        devices = await self._readings.read()
        self._sensors.powered(devices.unit_on)
        lease, sensors, motion = self.lease, self._sensors, self._motion()
        manual = LiveManual(
            lease.id,
            lease.holder,
            lease.reason,
            lease.until,
            self._bench.clock.now_s(),
            "" if motion is None else self._tasks[motion].kind,
            sensors.values,
            sensors.at_s,
            sensors.problem,
        )
        self._board.publish(BenchLive(lease.bench, now(), devices=devices, manual=manual))

    def _begin(self, demand: ManualDemand) -> None:
        if demand.id in self._seen:
            return
        self._seen.add(demand.id)
        if self._stop_stands():
            self._end_demands(STOPPED)
        elif self.expired:
            self._end_demands(TIME_OVER)
            self._over.set()
        if self._ended_because:
            self._not_begun(demand)
            return
        if demand.kind in MOTIONS and (refusal := self._motion_refusal(demand)) is not None:
            self._tell(demand, DemandState.REFUSED, refusal)
            return
        task = self._loop.create_task(self._do(demand))
        self._tasks[task] = demand
        task.add_done_callback(self._over_with)

    def _motion_refusal(self, demand: ManualDemand) -> Answer | None:
        """The refusal of a motion that would begin beside another, or while a halt brakes the table; None: it may."""
        if any(one.kind == "halt" for one in self._tasks.values()):
            text = "a halt is under way: wait until it is done and the table rests"
            return Answer(text, "kind", demand.kind, "a motion after the halt")
        if (motion := self._motion()) is not None:
            doing = self._tasks[motion].kind
            text = f"the table is moving ({doing}): halt it, or wait for its end; one motion at a time"
            return Answer(text, "kind", demand.kind, "halt")
        return None

    def _not_begun(self, demand: ManualDemand) -> None:
        text = f"the lease has ended: {self._ended_because or LEFT}; nothing was commanded"
        self._tell(demand, DemandState.STOPPED, Answer(text))

    def _over_with(self, task: "asyncio.Task[None]") -> None:
        """Forget a task that is over; one that was cancelled before its first step has not said so itself."""
        demand = self._tasks.pop(task)
        if demand.id not in self._begun:
            text = "a halt, a stop or the end of the lease came first; nothing was commanded"
            self._tell(demand, DemandState.STOPPED, Answer(text))

    async def _do(self, demand: ManualDemand) -> None:
        self._begun.add(demand.id)
        self._tell(demand, DemandState.DOING, Answer())
        state, answer = DemandState.DONE, Answer()
        try:
            answer = Answer(await self._work.do(demand))
        except BadParameter as refusal:
            answer = Answer(str(refusal), refusal.field, refusal.value, refusal.allowed)
            state = DemandState.REFUSED
        except OutOfRange as refusal:
            state, answer = DemandState.REFUSED, Answer(str(refusal))
        except Stopped as stopped:
            state, answer = DemandState.STOPPED, Answer(str(stopped))
        except Disconnected as lost:  # whether a demand was carried out is not known: the bench is made safe
            state, answer, self._failure = DemandState.FAILED, Answer(str(lost)), lost
            self._end_demands(str(lost))
        except BenchError as failure:
            state, answer = DemandState.FAILED, Answer(str(failure))
        except asyncio.CancelledError:
            state, answer = DemandState.STOPPED, Answer("a halt, a stop or the end of the lease came first")
            raise
        except Exception as defect:
            log.exception("manual lease %s: %s", self.lease.id, demand.kind)
            state, answer = DemandState.FAILED, Answer(f"{type(defect).__name__}: {defect}")
        finally:
            self._tell(demand, state, answer)
