"""A bench whose devices are remembered in a register: each demand is noted before the device receives it."""

from collections.abc import Callable, Mapping
from typing import Any

from bench_service.bench.devices import AT_REST, MOVING, DeviceState
from bench_service.bench.observed import ObservedBench
from bench_service.drivers.device_cables import DeviceCables
from bench_service.drivers.device_faults import DeviceFaults
from bench_service.drivers.device_register import DeviceLink, DeviceRegister
from procedures.bench import SAFE_ORDER, Bench
from procedures.bench.errors import BenchError, Disconnected, OutOfRange

READS = frozenset(f"{device}.{verb}" for device in (*SAFE_ORDER, "imu", "environment") for verb in ("read", "identify"))
"""Verbs that change nothing and are not noted."""
MOTIONS = frozenset(f"turntable.{verb}" for verb in ("move_to", "command_turn", "command_rate", "command_sinusoid"))
"""Demands after which the table moves."""
REMEMBERED = ("table", "powered", "chamber_target_c", "current_ma")
"""Fields of the state that change as soon as a demand is made; a refused demand does not change them."""
SAFE: dict[str, Callable[[DeviceState], dict[str, Any]]] = {
    "turntable": lambda _: {"table": AT_REST, "angles_deg": None},
    "chamber": lambda state: {"chamber_target_c": state.chamber_ambient_c},
    "current_source": lambda _: {"current_ma": 0.0},
    "supply": lambda _: {"powered": False},
}
"""State of each device after it is made safe."""
LOST = "as the bench's truth file has it"
"""Reason of a lost link that neither a person nor an exercise has lost."""


def simulated_safe_state(device: str, state: DeviceState) -> dict[str, Any]:
    """Return the fields of the register that change once a simulated device was made safe."""
    return SAFE[device](state)


class RegisterObserver:
    """Notes each verb in the register as the state that real devices would have, and stops verbs to devices whose link
    is lost.
    """

    def __init__(
        self,
        link: DeviceLink,
        cables: DeviceCables,
        faults: DeviceFaults | None,
        devices: frozenset[str],
        lost: Callable[[], frozenset[str]],
        safe_state: Callable[[str, DeviceState], dict[str, Any]],
    ) -> None:
        """Observe `devices`, which are to be made safe; `lost`: returns those whose link the simulation has lost.

        `safe_state`: changes of the state once a device was made safe.
        """
        self._safe_state = safe_state
        self._link = link
        self._cables = cables
        self._faults = faults
        self._lost = lost
        self._cut: frozenset[str] = frozenset()
        self._not_safe = set(devices)
        self._refusals: dict[str, str] = {}
        self._arguments: dict[str, Mapping[str, Any]] = {}
        self._before = link.state

    def begin(self, verb: str, arguments: Mapping[str, Any]) -> None:
        """Note a demand before the device has it: a crash in between leaves the bench thought less safe than it is.

        Raises `Disconnected` where it cannot reach the device.
        """
        if verb in READS:
            self._reach(verb)
            return
        self._before = self._link.state
        self._arguments[verb] = arguments
        changes: dict[str, Any] = {}
        if verb in MOTIONS:
            changes = {"table": MOVING}
        elif verb == "supply.switch_on":
            changes = {"powered": True}
        elif verb == "chamber.command":
            changes = {"chamber_target_c": arguments["temperature_c"]}
        elif verb == "current_source.set_current":
            changes = {"current_ma": arguments["current_ma"]}
        self._link.note(verb, dict(arguments), **changes)
        self._reach(verb)
        if self._faults is not None:
            self._faults.strike(verb, arguments)

    def end(self, verb: str, failure: BaseException | None) -> None:
        """Note the outcome of a demand in the register. One that was refused before anything moved changed nothing.
        `failure`: its error, None where it succeeded.
        """
        self._notice_losses()
        if verb in READS:
            return
        device, _, action = verb.partition(".")
        if failure is None:
            self._link.note(f"{verb}.done", {}, **self._done(device, action))
            return
        changes: dict[str, Any] = {}
        if action == "make_safe":
            self._refusals[device] = f"{device}: {failure}"
            changes = {"fault": "; ".join(self._refusals.values())}
        elif isinstance(failure, OutOfRange):
            changes = {name: getattr(self._before, name) for name in REMEMBERED}
        self._note_quietly(f"{verb}.failed", {"error": f"{type(failure).__name__}: {failure}"}, changes)

    def asked(self, device: str) -> None:
        """Check the link for a block and inject faults; the request is not noted, as there are too many."""
        self._reach(f"{device}.block")
        if self._faults is not None:
            self._faults.strike(f"{device}.block", {})

    def heard(self, device: str) -> None:
        self._notice_losses()

    def _reach(self, verb: str) -> None:
        self._notice_losses()
        self._cables.need(verb.partition(".")[0])

    def _notice_losses(self) -> None:
        """Record links that the simulation has lost, for later processes too, even if no verb went to the device."""
        fresh = self._lost() - self._cut
        for device in fresh:
            self._cables.cut(device, LOST)
        self._cut |= fresh

    def _done(self, device: str, action: str) -> dict[str, Any]:
        changes: dict[str, Any] = {}
        if action == "make_safe":
            changes = self._safe_state(device, self._link.state)
            self._not_safe.discard(device)
            self._refusals.pop(device, None)
            if not self._not_safe:
                changes["fault"] = ""
        elif device == "turntable" and action in ("move_to", "settle"):
            changes = {"table": AT_REST, "angles_deg": None}
            if action == "move_to":
                changes["angles_deg"] = tuple(self._arguments["turntable.move_to"]["angles_deg"])
        elif (device, action) == ("supply", "switch_off"):
            changes = SAFE["supply"](self._link.state)
        return changes

    def _note_quietly(self, verb: str, arguments: dict[str, Any], changes: dict[str, Any]) -> None:
        """Note a verb while another failure is reported: skip it if the link is gone, for that failure matters more."""
        if self._link.is_open:
            self._link.note(verb, arguments, **changes)


class RegisteredBench(ObservedBench):
    """A bench that holds the devices' link: while it is open, no other process commands them."""

    def __init__(
        self,
        bench: Bench,
        link: DeviceLink,
        cables: DeviceCables,
        faults: DeviceFaults | None = None,
        lost: Callable[[], frozenset[str]] = frozenset,
        safe_state: Callable[[str, DeviceState], dict[str, Any]] = simulated_safe_state,
    ) -> None:
        """Wrap a bench; `lost`: returns the devices whose links the simulation has lost by now.

        `safe_state`: changes of the register once a device was made safe.
        """
        devices = {"turntable", "supply"}
        devices |= {name for name in ("chamber", "current_source") if getattr(bench, name) is not None}
        super().__init__(bench, RegisterObserver(link, cables, faults, frozenset(devices), lost, safe_state))
        self._link = link

    def close(self) -> None:
        """Release the devices' link. A verb that is still under way finds it closed."""
        self._link.close()
        super().close()


class RegisteredDevices:
    """Implements `bench_service.bench.devices.BenchDevices` for a simulated bench by its register, without a world or a
    job.
    """

    def __init__(self, register: DeviceRegister) -> None:
        self._register = register

    def device_state(self) -> DeviceState | None:
        return self._register.read()

    def compare(self, by: str) -> tuple[str, ...]:
        """Return no differences: simulated devices are as their register says."""
        return ()

    def make_safe(self, by: str) -> DeviceState:
        """Stop the table, command the chamber to ambient, switch the unit off; return the state. The table of a dead
        process stops at once, at an unknown position.

        A device whose link is lost stays as it is, and keeps no other from being made safe. The job whose demands are
        undone stays known until the next one. Raises `DeviceBusy`, `BenchError` where the devices are real ones of a
        bench file, and an `ExceptionGroup` of the failures.
        """
        state = self._register.read()
        if state is not None and state.safe:
            return state
        if state is not None and state.bench_file:
            raise BenchError(
                f"the devices are real: only with their bench file, {state.bench_file}, can they be reached"
            )
        link = self._register.open(by, None if state is None else state.job)
        try:
            failures = [failure for device in SAFE_ORDER if (failure := self._make_safe(link, device)) is not None]
            fault = "; ".join(map(str, failures))
            link.note(f"bench.make_safe.{'failed' if fault else 'done'}", {}, fault=fault)
            if failures:
                raise ExceptionGroup("the bench could not be made safe", failures)
            return link.state
        finally:
            link.close()

    def _make_safe(self, link: DeviceLink, device: str) -> Disconnected | None:
        """Make one device safe; return why it could not be reached."""
        try:
            self._register.cables.need(device)
        except Disconnected as lost:
            link.note(f"{device}.make_safe.failed", {"error": str(lost)})
            return lost
        link.note(f"{device}.make_safe", {}, **SAFE[device](link.state))
        return None
