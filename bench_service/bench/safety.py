"""Safety of a bench: its known state, and making it safe. Used by HTTP, pages, and a service that starts."""

import logging
from collections.abc import Callable
from dataclasses import dataclass, replace
from datetime import datetime
from typing import Any

from bench_service.bench.devices import BenchDevices, DeviceState, commanded
from bench_service.bench.make_safe import Rescue, over_new_link
from bench_service.bench.processes import ProcessIdentity, Watch, living
from bench_service.bench.registry import BenchRegistry
from bench_service.model.errors import NotFound, NotSafe
from bench_service.model.records import BenchStop
from bench_service.wall_clock import monotonic_s, now, pause

STOPPING_S = 1.0
"""Maximum time that the answer to a stop waits for the devices to be safe [s, real time]."""
START_S = 3.0
"""Maximum time that a starting service waits for a supervisor that has the devices' link at this moment [s]."""
LOOK_S = 0.02

log = logging.getLogger(__name__)


@dataclass(frozen=True)
class Safety:
    """The known safety of a bench at one moment: safe or not (None: not known here), why, the devices' state, and the
    living worker and supervisor.
    """

    safe: bool | None
    """True or False where known; None: not known on this host, and not reported by the bench's own host."""
    explanation: str
    """Explanation for a person, in whole sentences."""
    devices: DeviceState | None
    worker: ProcessIdentity | None
    """The process of this host that drives the bench, if one is alive."""
    supervisor: ProcessIdentity | None
    """The process of this host that supervises it, if one is alive and gives its heartbeat."""
    silent_supervisor: ProcessIdentity | None = None
    """The supervisor of this host that is alive and gives no heartbeat: nobody watches over the bench."""

    @property
    def commanded(self) -> bool:
        """True while a living worker of this host has the devices' link (`bench_service.bench.devices.commanded`)."""
        return commanded(self.devices, self.worker)


class SafetyService:
    """Reads a bench's safety from its devices and processes on this host; for other hosts, from the database."""

    def __init__(
        self,
        benches: BenchRegistry,
        devices: Callable[[str], BenchDevices],
        watch: Callable[[str], Watch],
        note: Callable[[str, str, datetime, dict[str, Any]], None],
    ) -> None:
        """Set up with `devices` and `watch` of a bench, by its id; `note` appends an event to a job."""
        self._benches = benches
        self._append = note
        self._devices = devices
        self._watch = watch
        self._by = f"the service, {ProcessIdentity.own()}"

    def known(self, bench_id: str) -> Safety:
        """Return the bench's safety as it is known now, from the device register of this host, or from the database for
        a bench of another host. Raises `StorageFailure`.
        """
        state = self._devices(bench_id).device_state()
        watch = self._watch(bench_id)
        worker, supervisor = living(watch.driving()), watch.supervisor()
        silent = watch.silent_supervisor()
        if state is None:
            safe, explanation = _elsewhere(bench_id, self._benches.standing_stops(bench_id))
        else:
            safe, explanation = state.safe, _here(bench_id, state, worker, supervisor)
            if silent is not None:
                explanation += f" Its supervisor, {silent}, gives no heartbeat: nobody watches over the bench."
        return Safety(safe, explanation, state, worker, supervisor, silent)

    def stopping(self, bench_id: str, patient: bool = True) -> Safety:
        """The safety of a bench on this host shortly after its stop was requested; needs no database.

        Where no other process can, this one makes the devices safe. Not `patient`: answer at once.
        """
        found = self.known(bench_id)
        if found.safe is False and found.worker is None and found.supervisor is None:
            alone = found.explanation
            obstacle = over_new_link(self._devices(bench_id), self._by)
            found = self.known(bench_id)
            done = f"This service tried itself: {obstacle}." if obstacle else "This service made it safe itself."
            return replace(found, explanation=f"{alone} {done}")
        return self._within(bench_id, found) if patient else found

    def stopping_elsewhere(self, bench_id: str) -> Safety:
        """The safety of another host's bench, from the database, shortly after its stop. Raises `StorageFailure`."""
        return self._within(bench_id, self.known(bench_id))

    def _within(self, bench_id: str, found: Safety) -> Safety:
        deadline = monotonic_s() + STOPPING_S
        while (found.safe is not True or found.commanded) and monotonic_s() < deadline:
            pause(LOOK_S)
            found = self.known(bench_id)
        return found

    def require(self, bench_id: str) -> None:
        """Try to make the devices safe. Raises `NotSafe` with the reason where they are not known to be safe then."""
        found = self.known(bench_id)
        obstacle = over_new_link(self._devices(bench_id), self._by) if found.safe is False else None
        if obstacle is not None:
            raise NotSafe(f"bench {bench_id!r} is not released: {obstacle}")
        if found.safe is None:
            raise NotSafe(f"bench {bench_id!r} is not released: {found.explanation}")

    def at_start(self, bench_id: str, rescued: Rescue | None = None) -> None:
        """Make safe the devices that a dead process left unsafe, first of all; the bench's lease must be held.

        Where that fails the bench is stopped: the service answers, but nothing moves until a person has looked.
        A device that is not as its last reported state says stops the bench too. `rescued`: the state found, and the
        attempt made, before the database was opened.
        """
        devices = self._devices(bench_id)
        state = devices.device_state()
        if self._make_safe_at_start(bench_id, devices, state, rescued) and (found := devices.compare(self._by)):
            obstacle = over_new_link(devices, self._by)
            more = "" if obstacle is None else f"; {obstacle}"
            self.stop_unsafe(bench_id, f"the devices are not as they were left: {'; '.join(found)}{more}")

    def _make_safe_at_start(
        self, bench_id: str, devices: BenchDevices, state: DeviceState | None, rescued: Rescue | None
    ) -> bool:
        """Make the devices safe; False where that failed, which was said."""
        if state is None:  # the first start on this host: from now on the devices are known here
            obstacle = over_new_link(devices, self._by)
            if obstacle is not None and not obstacle.busy:
                self.stop_unsafe(bench_id, str(obstacle))
            elif obstacle is not None:
                log.warning("bench %s: %s", bench_id, obstacle)
            return obstacle is None
        if state.safe and rescued is None:
            return True
        deadline = monotonic_s() + START_S
        obstacle = over_new_link(devices, self._by)
        while obstacle is not None and monotonic_s() < deadline:
            pause(LOOK_S * 5)
            obstacle = over_new_link(devices, self._by)
        left = state if rescued is None else rescued.left
        text = f"when the service started, {' and '.join(left.unsafe)}: "
        if obstacle is None:
            self._note(left.job, text + "made safe first")
        else:
            self.stop_unsafe(bench_id, str(obstacle))
            self._note(left.job, text + str(obstacle))
        return obstacle is None

    def stop_unsafe(self, bench_id: str, why: str) -> None:
        """Store a stop of a bench that could not be made safe: nothing may run on it until a person releases the
        stop.
        """
        log.error("bench %s: %s", bench_id, why)
        self._benches.stop_bench_once(BenchStop(bench_id, now(), why, by=self._by))

    def _note(self, job: str | None, text: str) -> None:
        log.warning("%s", text)
        if job is not None:
            try:
                self._append(job, "note", now(), {"text": text, "by": self._by})
            except NotFound:  # a job of another database: the register or the database was moved
                return


def _here(bench_id: str, state: DeviceState, worker: ProcessIdentity | None, supervisor: ProcessIdentity | None) -> str:
    if state.safe:
        return "The devices are safe: the table is at rest, the unit is off."
    unsafe = f"The devices are not safe: {', '.join(state.unsafe)}."
    if commanded(state, worker):
        return f"{unsafe} The worker, {worker}, drives them."
    if supervisor is not None:
        return f"{unsafe} No worker drives them; the supervisor, {supervisor}, makes them safe."
    if worker is not None:
        return f"{unsafe} The worker, {worker}, has abandoned them; a release tries again."
    return (
        f"{unsafe} On this host neither a worker nor a supervisor of bench {bench_id!r} is alive: start one, or use "
        "the hardware emergency stop."
    )


def _elsewhere(bench_id: str, stops: tuple[BenchStop, ...]) -> tuple[bool | None, str]:
    """Safe where the devices were seen safe after the last stop: a bench that works in between may be anything."""
    if stops and all(stop.safe_at is not None for stop in stops):
        stop, seen = stops[-1], max(stop.safe_at for stop in stops if stop.safe_at is not None)
        return True, f"Seen safe on the bench's host at {seen.isoformat()}, last commanded by {stop.safe_by}."
    return None, (
        f"The devices of bench {bench_id!r} are not on this host, and no process there has reported that they are "
        "safe: whether a worker or a supervisor is alive there is not known here."
    )
