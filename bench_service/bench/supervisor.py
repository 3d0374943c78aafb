"""The supervisor of a bench: a process that outlives the worker, and makes the bench safe where the worker cannot.

It looks at four things: which process drives the bench and whether it lives, the devices' last reported state,
whether the bench is stopped, and whether the driving process gives its heartbeat. It restarts nothing.
While the process that drives the bench lives, it ends one that does not answer a stop, or gives no heartbeat while the
bench is not safe, and commands the devices only where their link was given back and they are not safe: of a stopped
bench after a second, of another one after five.

It acts on files of its host alone; a database that does not answer is updated later.
"""

import logging
import select
import socket
from collections.abc import Callable
from threading import Event, Lock, Thread

from bench_service.background import NonBlockingQuery
from bench_service.bench.devices import BenchDevices, DeviceState, commanded
from bench_service.bench.heartbeat import HeartbeatFile
from bench_service.bench.make_safe import over_new_link
from bench_service.bench.processes import Driving, ProcessIdentity, Watch, living
from bench_service.bench.stop.channel import SUPERVISOR, WORKER, StopChannel
from bench_service.bench.stop.exchange import StopExchange
from bench_service.bench.stop.word import StopAnswer
from bench_service.bench.supervisor_ports import Lease, Listener, SafetyBooks
from bench_service.bench.worker_time_limits import HUNG_S, SILENT_S, UNANSWERED_S, WorkerTimeLimits
from bench_service.model.errors import BenchBusy, ServiceError
from bench_service.wall_clock import monotonic_s

LOOK_S = 0.1
"""Interval between two looks at the bench [s]: a worker's death is noticed within this."""
STOP_LOOK_S = 0.5
"""Interval between two queries of the database for stops of the bench [s]."""
ANSWER_S = 0.1
"""Time that a look waits for the database's answer [s]; a later answer is seen by a later look."""
LEASE_S = 0.8
"""Time that the supervisor waits for the lease of a dead worker [s]; after it, the devices' own link, which is
exclusive too, has to suffice."""
AGAIN_S = 1.0
"""Interval between two attempts to make devices safe that could not be made safe [s]."""
LEFT_S = 5.0
"""Time after which devices are made safe that a living worker of a bench without a stop has left unsafe [s]: it could
not reach them, nor the database to stop the bench.
"""
LOOK_MARGIN_S = 30.0
"""Added to a worker's longest time to be safe: a look that takes longer is stuck, and the heartbeat ends [s]."""
LINGER_S = 60.0
"""Time that the supervisor stays after a crash of the worker, once the bench is safe [s]."""

log = logging.getLogger(__name__)


class Supervisor:
    """Watches one bench from a process of its own, and makes it safe where the worker is dead or hangs; runs until it
    is ended, or nothing is left to watch.
    """

    def __init__(
        self,
        bench_id: str,
        devices: BenchDevices,
        watch: Watch,
        books: SafetyBooks,
        take_lease: Callable[[], Lease],
        channel: StopChannel,
        heartbeat: HeartbeatFile,
        listener: Listener | None = None,
        hung_s: float = HUNG_S,
        linger_s: float = LINGER_S,
        unanswered_s: float = UNANSWERED_S,
        silent_s: float = SILENT_S,
    ) -> None:
        self._bench_id = bench_id
        self._devices = devices
        self._watch = watch
        self._books = books
        self._take_lease = take_lease
        self._channel = channel
        self._listener = listener
        self._exchange = StopExchange(channel, books)
        self._limits = WorkerTimeLimits(channel, heartbeat, unanswered_s, hung_s, silent_s)
        self._linger_s = linger_s
        self._by = f"the supervisor, {ProcessIdentity.own()}"
        self._asked_books = NonBlockingQuery("books", self._ask_books)
        self._unsaid: list[tuple[str, str | None]] = []
        self._unsaid_stop: str | None = None
        self._stopped = False
        """True while the bench is stopped, by the channel or by the last answer of the database."""
        self._told_not_safe = False
        self._next_stop_look_s = 0.0
        self._next_try_s = 0.0
        self._first_try_s: float | None = None
        """Time of the first failed attempt to make the devices safe; None: none has failed."""
        self._left_since_s: float | None = None
        self._gone_since_s: float | None = None
        self._looked_s = self._began_s = monotonic_s()
        self._longest_look_s = hung_s + LOOK_MARGIN_S

    def goes_on(self) -> bool:
        """Return whether the looks go on: none takes longer than the slowest device may take to be safe, and some."""
        return monotonic_s() - self._began_s < self._longest_look_s

    def run(self, ending: Event, companion: bool) -> None:
        """Watch, and block, until `ending` is set; a `companion` also ends with the process that it accompanies."""
        listening = self._channel.listen(SUPERVISOR)
        try:
            while not ending.is_set() and self._look_once(listening, ending, companion):
                pass
        finally:
            if listening is not None:
                listening.close()
            self._channel.close()

    def _look_once(self, listening: socket.socket | None, ending: Event, companion: bool) -> bool:
        """Wait for a message or for `LOOK_S`, then look; True while there is something left to watch."""
        self._began_s = monotonic_s()
        if listening is None:
            ending.wait(LOOK_S)
        elif select.select((listening,), (), (), LOOK_S)[0]:
            self._channel.receive(listening)
        try:
            return ending.is_set() or self.look(companion)
        except Exception:  # the supervisor must outlive any defect
            log.exception("the supervisor of bench %s", self._bench_id)
            ending.wait(LOOK_S)
            return True

    def look(self, companion: bool = False) -> bool:
        """Look at the worker and the devices once, and make the bench safe where that is due. Returns False once a
        `companion` has nothing left to watch.
        """
        now_s = monotonic_s()
        driving, state = self._watch.driving(), self._devices.device_state()
        worker = living(driving)
        if state is not None and state.safe:  # whichever process made it safe
            self._told_not_safe, self._first_try_s = False, None
        self._look_for_stop(now_s)
        words = self._answer_stop(state, worker)
        self._stopped = bool(words) or self._exchange.stopped
        if worker is not None:
            self._gone_since_s = None
            self._end_hung(now_s, worker, state, words)
            self._look_for_left(now_s, state)
        else:
            self._limits.reset(now_s)
            self._left_since_s = None
            self._gone_since_s = now_s if self._gone_since_s is None else self._gone_since_s
            if state is not None and not state.safe and now_s >= self._next_try_s:
                self._rescue(now_s, driving, state)
                return True
        self._looked_s = now_s
        return not companion or worker is not None or not self._may_leave(now_s, driving, state)

    def _may_leave(self, now_s: float, driving: Driving | None, state: DeviceState | None) -> bool:
        """Return whether it may end: at once after an orderly end, later after a crash, never from an unsafe bench."""
        if self._unsaid or self._unsaid_stop is not None or (state is not None and not state.safe):
            return False
        assert self._gone_since_s is not None
        in_order = driving is not None and driving.ended
        return in_order or now_s - self._gone_since_s > self._linger_s

    def _look_for_stop(self, now_s: float) -> None:
        """Exchange stops and reports with the database; its last answer holds until the next one."""
        if now_s < self._next_stop_look_s and not self._unsaid:
            return
        self._next_stop_look_s = now_s + STOP_LOOK_S
        try:
            self._asked_books.ask(ANSWER_S)
        except ServiceError as error:
            log.warning("the database does not answer the supervisor of bench %s: %s", self._bench_id, error)

    def _ask_books(self) -> None:
        """Make all exchanges with the database, in a thread of their own."""
        self._exchange.exchange()
        if self._listener is not None and (at := self._listener.listening()) is not None:
            self._books.say_listening(at)
        worker, state = living(self._watch.driving()), self._devices.device_state()
        if self._exchange.stopped and state is not None and state.safe and not commanded(state, worker):
            self._books.confirm_safe(state.by)
        if self._unsaid_stop is not None:
            self._books.stop(self._unsaid_stop, self._by)
            self._unsaid_stop = None
        while self._unsaid:
            self._books.note(self._by, *self._unsaid[0])
            self._unsaid.pop(0)

    def _answer_stop(self, state: DeviceState | None, worker: ProcessIdentity | None) -> frozenset[str]:
        """Answer the stop requests in the channel; their ids."""
        ids = frozenset(word.id for word in self._channel.standing())
        if ids:
            safe = self._channel.answered(SUPERVISOR).safe & ids
            if state is not None and state.safe:  # a worker that has their link says itself when it has left its work
                safe |= self._channel.answered(WORKER).safe & ids if commanded(state, worker) else ids
            self._channel.answer(SUPERVISOR, StopAnswer(self._by, ids, safe))
        return ids

    def _end_hung(
        self, now_s: float, worker: ProcessIdentity, state: DeviceState | None, words: frozenset[str]
    ) -> None:
        """Kill a worker with the devices' link that leaves them unsafe and is silent or hung, or answers no stop."""
        if state is None or not state.linked:
            self._limits.reset(now_s)
            return
        why = self._limits.over(now_s, worker, words, self._stopped, state.safe)
        if why is not None and worker.kill():
            self._say(f"{worker} {why} ({', '.join(state.unsafe) or 'the devices are safe'}): killed", state.job)
            self._limits.reset(now_s)

    def _look_for_left(self, now_s: float, state: DeviceState | None) -> None:
        """Make devices safe that a living worker has left unsafe and given back: it does nothing more with them."""
        if state is None or state.safe or state.linked:
            self._left_since_s = None
        elif self._left_since_s is None:
            self._left_since_s = now_s
        elif now_s - self._left_since_s > (AGAIN_S if self._stopped else LEFT_S) and now_s >= self._next_try_s:
            self._try(now_s, "the bench is stopped" if self._stopped else "its worker has left it unsafe", state)

    def _rescue(self, now_s: float, driving: Driving | None, state: DeviceState) -> None:
        """Make an unsafe bench safe that no process drives."""
        lease = self._lease_within(LEASE_S)
        again = living(self._watch.driving())
        try:
            if again is None:  # else a process took the bench this moment, and makes it safe itself
                self._try(now_s, f"{driving.process} is gone" if driving else "no process drives the bench", state)
        finally:
            if lease is not None:
                lease.release()
        self._next_stop_look_s = 0.0

    def _try(self, now_s: float, why: str, state: DeviceState) -> None:
        """Make the devices safe over their own link, and report it; where that fails, try again later."""
        obstacle = over_new_link(self._devices, self._by)
        if obstacle is not None:
            self._next_try_s = now_s + AGAIN_S
            if obstacle.busy:
                log.warning("bench %s: %s", self._bench_id, obstacle)
                return
            self._first_try_s = now_s if self._first_try_s is None else self._first_try_s
            self._not_safe(str(obstacle), state)
            return
        safe_s, unsafe = monotonic_s(), " and ".join(state.unsafe)
        if self._first_try_s is not None:
            how = f"at last, {safe_s - self._first_try_s:.3f} s after its first try"
        else:
            how = f"{safe_s - now_s:.3f} s after it noticed"
            how += "" if self._left_since_s else f", at most {safe_s - self._looked_s:.3f} s after that end"
        self._say(f"{why}, and {unsafe}: made safe by the supervisor {how}", state.job)
        self._told_not_safe, self._first_try_s = False, None

    def _not_safe(self, why: str, state: DeviceState) -> None:
        """Stop the bench until a person has looked. Reported once, though the attempts continue."""
        if self._told_not_safe:
            return
        self._unsaid_stop = why
        self._say(self._unsaid_stop, state.job)
        self._told_not_safe = True

    def _lease_within(self, seconds: float) -> Lease | None:
        """Take the bench's lease; None where it does not come in time, as from a server that is silent."""
        found: list[Lease] = []
        deciding, given_up = Lock(), Event()

        def take() -> None:
            while not given_up.is_set():
                try:
                    lease = self._take_lease()
                except BenchBusy:
                    given_up.wait(0.05)
                    continue
                except ServiceError:
                    return
                with deciding:
                    if not given_up.is_set():
                        found.append(lease)
                        return
                lease.release()

        thread = Thread(target=take, name="lease", daemon=True)
        thread.start()
        thread.join(seconds)
        with deciding:
            given_up.set()
            return found[0] if found else None

    def _say(self, text: str, job: str | None) -> None:
        log.warning("bench %s: %s", self._bench_id, text)
        self._unsaid.append((text, job))
