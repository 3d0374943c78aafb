"""The guard of a process that drives a bench: it watches the stop channel and writes the heartbeat.

A thread of its own that needs no database and no free disk. Whatever else the process waits for, a stop that came by
the channel is seen here, and the bench made safe in yet another thread. Where not even this thread gets to run, the
supervisor, another process, sees no answer and kills this one.
"""

import logging
import select
import socket
from collections.abc import Callable
from threading import Event, Thread

from bench_service.bench.heartbeat import BEAT_S, HeartbeatFile
from bench_service.bench.processes import ProcessIdentity
from bench_service.bench.stop.channel import WORKER, StopChannel
from bench_service.bench.stop.word import StopAnswer
from bench_service.wall_clock import monotonic_s

LOOK_S = 0.1
"""Interval between two looks at the channel's file [s]; its socket wakes the guard at once."""

log = logging.getLogger(__name__)


class StopGuard:
    """Guards the bench that this process drives, from `begin` to `end`: a thread that watches the stop channel, has the
    bench made safe, and writes the heartbeat.
    """

    def __init__(
        self,
        channel: StopChannel,
        heartbeat: HeartbeatFile,
        is_safe: Callable[[], bool],
        make_safe: Callable[[], object],
        wake: Callable[[], object],
    ) -> None:
        """Set up with `is_safe`: the devices' reported state; and `make_safe`: leaves the job and makes the bench safe.

        `make_safe` is called at least once for each stop, also where the devices are safe when it comes: a job that
        has their link would command them next. It may take a while, and is called again while a stop stands and the
        bench is not safe. `wake`: called when there may be something to do.
        """
        self._channel = channel
        self._heartbeat = heartbeat
        self._is_safe = is_safe
        self._make_safe = make_safe
        self._wake = wake
        self._by = f"the worker, {ProcessIdentity.own()}"
        self._ending = Event()
        self._acting: Thread | None = None
        self._left: frozenset[str] = frozenset()
        """Stops for which the work under way was left."""
        self._next_beat_s = 0.0
        self._beats = True
        self._socket: socket.socket | None = None
        self._thread = Thread(target=self._run, name="stop guard", daemon=True)

    def begin(self) -> None:
        """Start the guard's thread. Channel and heartbeat must be prepared, the bench's lease held."""
        self._socket = self._channel.listen(WORKER)
        self._thread.start()

    def stopped(self) -> bool:
        """Return whether a stop over the channel stands."""
        return bool(self._channel.standing())

    def end(self) -> None:
        """End the guard's thread and wait for it, then close channel and heartbeat; the bench must be safe by then."""
        self._ending.set()
        self._thread.join()
        if self._socket is not None:
            self._socket.close()
        self._heartbeat.close()
        self._channel.close()

    def _run(self) -> None:
        while not self._ending.is_set():
            try:
                woken = self._wait()
                self._look()
                if woken:
                    self._wake()
            except Exception:  # the guard must outlive any defect
                log.exception("the stop guard of bench %s", self._channel.bench_id)
                self._ending.wait(LOOK_S)

    def _wait(self) -> bool:
        """Wait for a message, `LOOK_S` at the most; True where one was a call to look for work."""
        if self._socket is None:
            self._ending.wait(LOOK_S)
            return False
        poll = select.poll()  # not select: it cannot watch a descriptor above 1023
        poll.register(self._socket, select.POLLIN)
        return bool(poll.poll(LOOK_S * 1000)) and self._channel.receive(self._socket)

    def _look(self) -> None:
        self._beat()
        words = self._channel.standing()
        if not words:
            return
        ids = frozenset(word.id for word in words)
        left = self._left  # before the devices are looked at: what was left cannot command them afterwards
        safe = ids & left if self._is_safe() else frozenset[str]()
        said = self._channel.answered(WORKER)
        self._channel.answer(WORKER, StopAnswer(self._by, ids, safe | (said.safe & ids)))
        if safe != ids and (self._acting is None or not self._acting.is_alive()):
            self._acting = Thread(target=self._act, args=(ids,), name="stop", daemon=True)
            self._acting.start()

    def _act(self, ids: frozenset[str]) -> None:
        try:
            self._make_safe()
        except Exception:  # tried again at the next look
            log.exception("bench %s could not be made safe", self._channel.bench_id)
        else:
            self._left = ids

    def _beat(self) -> None:
        now_s = monotonic_s()
        if now_s < self._next_beat_s:
            return
        self._next_beat_s = now_s + BEAT_S
        try:
            self._heartbeat.beat()
            self._beats = True
        except OSError as error:
            if self._beats:
                log.warning("the heartbeat of bench %s cannot be written: %s", self._channel.bench_id, error)
            self._beats = False
