"""Making a bench safe: the order of the steps, written once for every situation in which a bench must be made safe.

1. Where a job's session has the devices' link: the step under way is left, the procedure is closed, and the devices
   are made safe over that link: simulated ones in the order of `procedures.bench.SAFE_ORDER`, real ones at the same
   time.
2. The session's link is given back, so that nothing that still comes from the job reaches a device.
3. Where a device did not answer over that link, or there was none: the devices are made safe over a link of its own.

A job's end, a stop, a start, the supervisor and a release all use this module. Only a job goes through all three steps;
the others take the third alone. None of it needs a database.
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Protocol

from bench_service.bench.devices import BenchDevices, DeviceState
from procedures.bench.errors import BenchError, DeviceBusy, Disconnected


class DrivingSession(Protocol):
    """The part of a job's session that is needed here (`bench_service.bench.session.BenchSession`)."""

    def make_safe(self) -> None:
        """Make the devices safe, and wait until they are. Raises an `ExceptionGroup`, and `Disconnected` where a device
        does not answer.
        """
        ...

    def close(self) -> None:
        """Give the devices' link back; a second time does nothing."""
        ...


@dataclass(frozen=True)
class Obstacle:
    """Reasons for which a bench could not be made safe: one sentence a failure; `busy`: another process has the
    devices' link.
    """

    reasons: tuple[str, ...]
    busy: bool = False
    """True where another process has the devices' link."""

    @property
    def why(self) -> str:
        """All reasons in one line, joined by semicolons."""
        return "; ".join(self.reasons)

    @property
    def reason(self) -> str:
        """The failures as a predicate about the bench, for the stop that stands afterwards: "could not be made safe:
        …".
        """
        return f"could not be made safe: {self.why}"

    def __str__(self) -> str:
        return self.why if self.busy else self.reason


@dataclass(frozen=True)
class SafetyOutcome:
    """Outcome of making a bench safe after a job's session: the obstacle that remains, and the failure of the session's
    own link.
    """

    obstacle: Obstacle | None = None
    """The failure that remains; None: the bench is safe."""
    detour: str = ""
    """The failure of the job's own link, where a new link was then used."""


def over_new_link(devices: BenchDevices, by: str) -> Obstacle | None:
    """Open a link to devices that no job of this process has, and make them safe; return what hindered it, None where
    they are safe. Safe devices get no command.
    """
    try:
        state = devices.make_safe(by)
    except DeviceBusy as busy:
        return Obstacle((str(busy),), busy=True)
    except BenchError as error:
        return Obstacle((str(error),))
    except ExceptionGroup as group:
        return Obstacle(tuple(map(str, group.exceptions)))
    except OSError as error:  # another user's file, or no descriptor left
        return Obstacle((f"the devices' register cannot be used: {error}",))
    return None if state.safe else Obstacle(state.unsafe)


def has_register(devices: BenchDevices) -> bool:
    """Return whether devices have a register on this host; True also where it cannot be read now."""
    try:
        return devices.device_state() is not None
    except OSError:  # no descriptor left, for one: a stop must not end here
        return True


def still_unsafe(devices: BenchDevices, by: str, of: str) -> str | None:
    """The reason to stop a bench whose devices do not read as safe at the end `of` something, by their register.

    To be called once every device has reported that it is safe and nothing else can reach them; None: they are safe, or
    have no register. They are made safe over a new link then; the bench is stopped all the same, as nobody knows the
    cause.
    """
    state = devices.device_state()
    if state is None or state.safe:
        return None
    obstacle = over_new_link(devices, by)
    then = "it was made safe afterwards, over a new link" if obstacle is None else f"it {obstacle}"
    return f"was not safe at the end of {of}: {' and '.join(state.unsafe)}; {then}"


@dataclass(frozen=True)
class Rescue:
    """The unsafe state of a bench that a starting process found, and the result of making it safe."""

    left: DeviceState
    obstacle: Obstacle | None


def before_anything_else(devices: BenchDevices, by: str) -> Rescue | None:
    """Make devices safe that a dead process left unsafe; None where they were safe. Needs no database or disk space.

    Where another process has the devices' link it is left alone: that one drives them.
    """
    left = devices.device_state()
    if left is None or left.safe:
        return None
    obstacle = over_new_link(devices, by)
    return None if obstacle is not None and obstacle.busy else Rescue(left, obstacle)


def over_the_jobs_link(session: DrivingSession) -> tuple[tuple[str, ...], bool]:
    """Make devices safe over the link of a job; return the failures, and whether a new link may avoid them all."""
    try:
        session.make_safe()
    except ExceptionGroup as group:
        return tuple(map(str, group.exceptions)), group.split(Disconnected)[1] is None
    except Disconnected as silence:
        return (str(silence),), True
    return (), True


def end_safely(
    session: DrivingSession, devices: BenchDevices, by: str, given_back: Callable[[], None]
) -> SafetyOutcome:
    """Make the bench of a job's session safe, over the session's link and else over a new one, and end the session;
    return how it went. `given_back` is called once the session's link is closed.
    """
    failed: tuple[str, ...] = ()
    new_link_may_help = True
    try:
        failed, new_link_may_help = over_the_jobs_link(session)
    finally:
        given_back()
        session.close()
    if not failed:
        return SafetyOutcome()
    if not new_link_may_help:
        return SafetyOutcome(Obstacle(failed))
    why = "; ".join(failed)
    obstacle = over_new_link(devices, by)
    if obstacle is None:
        return SafetyOutcome(detour=why)
    again = tuple(reason for reason in obstacle.reasons if reason not in why)
    return SafetyOutcome(Obstacle((*failed, *again), obstacle.busy), why)
