"""The supervisor of a bench: a process that outlives the worker, and makes the bench safe where the worker cannot.

It looks at three things: which process drives the bench and whether it lives, what the devices last said of themselves,
and whether a person has stopped the bench. It starts nothing again. While the process that drives the bench lives, it
ends one that does not answer a stop, and commands the devices only of a stopped bench whose link was given back.
"""

import logging
from collections.abc import Callable
from threading import Event, Lock, Thread
from typing import Protocol

from bench_service.background import NonBlockingQuery
from bench_service.bench.devices import BenchDevices, DeviceState
from bench_service.bench.processes import Driving, ProcessIdentity, Watch
from bench_service.model.errors import BenchBusy, ServiceError
from bench_service.wall_clock import monotonic_s
from procedures.bench.errors import BenchError, DeviceBusy

LOOK_S = 0.1
"""How often the bench is looked at [s]: a worker's death is noticed within this."""
STOP_LOOK_S = 0.5
"""How often the database is asked whether the bench is stopped [s]."""
HUNG_S = 10.0
"""How long a worker may leave a stop unanswered before it is killed [s]."""
ANSWER_S = 0.1
"""How long a look waits for the database's answer [s]; one that comes later is seen by a later look."""
LEASE_S = 0.8
"""How long the lease of a dead worker is waited for [s]: then the devices' own link, exclusive too, must do."""
AGAIN_S = 1.0
"""How often devices that could not be made safe are tried again [s]."""
LINGER_S = 60.0
"""How long it stays after a crash, once the bench is safe [s]."""

log = logging.getLogger(__name__)


class Lease(Protocol):
    """The right to drive a bench."""

    def release(self) -> None: ...


class SafetyBooks(Protocol):
    """What the supervisor reads and writes in the database. Every verb raises `ServiceError` if it does not answer."""

    def stopped(self) -> bool:
        """Whether the bench is stopped."""
        ...

    def confirm_safe(self, by: str) -> None:
        """A stopped bench is safe. Said again and again, it is noted once in each stop that stands."""
        ...

    def stop(self, reason: str, by: str) -> None:
        """Stop the bench until a person releases it."""
        ...

    def note(self, by: str, text: str, job: str | None) -> None:
        """Say what was done: in the trail, and to the job that it concerns."""
        ...


class Supervisor:
    """Watches one bench until it is told to end, or nothing is left to watch."""

    def __init__(
        self,
        bench_id: str,
        devices: BenchDevices,
        watch: Watch,
        books: SafetyBooks,
        take_lease: Callable[[], Lease],
        hung_s: float = HUNG_S,
        linger_s: float = LINGER_S,
    ) -> None:
        self._bench_id = bench_id
        self._devices = devices
        self._watch = watch
        self._books = books
        self._take_lease = take_lease
        self._hung_s = hung_s
        self._linger_s = linger_s
        self._by = f"the supervisor, {ProcessIdentity.own()}"
        self._asked_books = NonBlockingQuery("books", self._ask_books)
        self._unsaid: list[tuple[str, str | None]] = []
        self._unsaid_stop: str | None = None
        self._stopped = False
        self._told_not_safe = False
        self._next_stop_look_s = 0.0
        self._next_try_s = 0.0
        self._first_try_s: float | None = None
        """Of devices that could not be made safe so far."""
        self._unanswered_since_s: float | None = None
        self._left_since_s: float | None = None
        self._gone_since_s: float | None = None
        self._looked_s = monotonic_s()

    def run(self, ending: Event, companion: bool) -> None:
        """Watch until `ending` is set; a `companion` also ends with the process that it accompanies."""
        while not ending.wait(LOOK_S):
            if not self.look(companion):
                return

    def look(self, companion: bool = False) -> bool:
        """Look once, and do what must be done; False once a companion has nothing left to watch."""
        now_s = monotonic_s()
        driving, state = self._watch.driving(), self._devices.device_state()
        alive = driving is not None and driving.alive
        if state is not None and state.safe:  # whoever made it so
            self._told_not_safe, self._first_try_s = False, None
        self._look_for_stop(now_s)
        if alive:
            self._gone_since_s = None
            self._look_for_hang(now_s, driving, state)
            self._look_for_left(now_s, state)
        else:
            self._unanswered_since_s = self._left_since_s = None
            self._gone_since_s = now_s if self._gone_since_s is None else self._gone_since_s
            if state is not None and not state.safe and now_s >= self._next_try_s:
                self._rescue(now_s, driving, state)
                return True
        self._looked_s = now_s
        return not companion or alive or not self._may_leave(now_s, driving, state)

    def _may_leave(self, now_s: float, driving: Driving | None, state: DeviceState | None) -> bool:
        """After an orderly end at once; after a crash when it has lasted; but never from a bench that is not safe."""
        if self._unsaid or self._unsaid_stop is not None or (state is not None and not state.safe):
            return False
        assert self._gone_since_s is not None
        in_order = driving is not None and driving.ended
        return in_order or now_s - self._gone_since_s > self._linger_s

    def _look_for_stop(self, now_s: float) -> None:
        """Ask the database, and tell it; the last answer holds while it says nothing."""
        if now_s < self._next_stop_look_s and not self._unsaid:
            return
        self._next_stop_look_s = now_s + STOP_LOOK_S
        try:
            self._asked_books.ask(ANSWER_S)
        except ServiceError as error:
            log.warning("the database does not answer the supervisor of bench %s: %s", self._bench_id, error)

    def _ask_books(self) -> None:
        """In a thread of its own: all that goes to the database."""
        self._stopped = self._books.stopped()
        state = self._devices.device_state()
        if self._stopped and state is not None and state.safe:
            self._books.confirm_safe(state.by)
        if self._unsaid_stop is not None:
            self._books.stop(self._unsaid_stop, self._by)
            self._unsaid_stop = None
        while self._unsaid:
            self._books.note(self._by, *self._unsaid[0])
            self._unsaid.pop(0)

    def _look_for_hang(self, now_s: float, driving: Driving | None, state: DeviceState | None) -> None:
        """A worker that lives, is told to stop, has the devices' link and leaves them unsafe, does not answer."""
        if not self._stopped or state is None or state.safe or not state.linked:
            self._unanswered_since_s = None
            return
        if self._unanswered_since_s is None:
            self._unanswered_since_s = now_s
        elif now_s - self._unanswered_since_s > self._hung_s and driving is not None and driving.process.kill():
            unsafe = ", ".join(state.unsafe)
            self._say(f"{driving.process} left a stop unanswered for {self._hung_s:g} s ({unsafe}): killed", state.job)
            self._unanswered_since_s = None

    def _look_for_left(self, now_s: float, state: DeviceState | None) -> None:
        """A worker that lives and has given the link of devices back that could not be made safe does nothing more."""
        if not self._stopped or state is None or state.safe or state.linked:
            self._left_since_s = None
        elif self._left_since_s is None:
            self._left_since_s = now_s
        elif now_s - self._left_since_s > AGAIN_S and now_s >= self._next_try_s:
            self._try(now_s, "the bench is stopped", state)

    def _rescue(self, now_s: float, driving: Driving | None, state: DeviceState) -> None:
        """Nobody drives the bench, and it is not safe."""
        lease = self._lease_within(LEASE_S)
        again = self._watch.driving()
        try:
            if again is None or not again.alive:  # else somebody took the bench this moment, and makes it safe himself
                self._try(now_s, f"{driving.process} is gone" if driving else "nobody drives the bench", state)
        finally:
            if lease is not None:
                lease.release()
        self._next_stop_look_s = 0.0

    def _try(self, now_s: float, why: str, state: DeviceState) -> None:
        """Make the devices safe over their own link, and say so; where that fails, try again later."""
        try:
            self._devices.make_safe(self._by)
        except DeviceBusy as busy:
            log.warning("bench %s: %s", self._bench_id, busy)
            self._next_try_s = now_s + AGAIN_S
        except (BenchError, ExceptionGroup) as failure:
            self._next_try_s = now_s + AGAIN_S
            self._first_try_s = now_s if self._first_try_s is None else self._first_try_s
            self._not_safe(failure, state)
        else:
            safe_s, unsafe = monotonic_s(), " and ".join(state.unsafe)
            if self._first_try_s is not None:
                how = f"at last, {safe_s - self._first_try_s:.3f} s after its first try"
            else:
                how = f"{safe_s - now_s:.3f} s after it noticed"
                how += "" if self._left_since_s else f", at most {safe_s - self._looked_s:.3f} s after that end"
            self._say(f"{why}, and {unsafe}: made safe by the supervisor {how}", state.job)
            self._told_not_safe, self._first_try_s = False, None

    def _not_safe(self, failure: Exception, state: DeviceState) -> None:
        """Nothing else may run on it until a person has looked. Said once, tried again and again."""
        if self._told_not_safe:
            return
        reasons = "; ".join(map(str, failure.exceptions)) if isinstance(failure, ExceptionGroup) else str(failure)
        self._unsaid_stop = f"could not be made safe: {reasons}"
        self._say(self._unsaid_stop, state.job)
        self._told_not_safe = True

    def _lease_within(self, seconds: float) -> Lease | None:
        """The bench's lease; None where it does not come in time, because a server does not know of a death yet, or
        does not answer at all."""
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
