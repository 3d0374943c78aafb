"""A bench whose devices are remembered in a register: what is asked of them is noted before they are asked."""

from collections.abc import Mapping
from typing import Any

from bench_service.drivers.device_faults import DeviceFaults
from bench_service.drivers.device_register import DeviceLink, DeviceRegister
from bench_service.jobs.devices import AT_REST, MOVING, DeviceState
from bench_service.jobs.observed import ObservedBench
from procedures.bench import Bench
from procedures.bench.errors import OutOfRange

READS = frozenset({"turntable.read_angles", "turntable.is_moving", "supply.is_on", "chamber.read"})
"""Verbs that change nothing: not noted."""
REMEMBERED = ("table", "powered", "chamber_target_c", "current_ma")
"""What a demand changes as soon as it is made, and a refused one did not."""


class RegisterObserver:
    """Turns verbs into the state that real devices would have."""

    def __init__(self, link: DeviceLink, faults: DeviceFaults | None, devices: frozenset[str]) -> None:
        self._link = link
        self._faults = faults
        self._not_safe = set(devices)
        self._arguments: dict[str, Mapping[str, Any]] = {}
        self._before = link.state

    def begin(self, verb: str, arguments: Mapping[str, Any]) -> None:
        """Note a demand before the device has it: a crash in between leaves the bench thought less safe than it is."""
        if verb in READS:
            return
        self._before = self._link.state
        self._arguments[verb] = arguments
        changes: dict[str, Any] = {}
        if verb in ("turntable.move_to", "turntable.command_turn"):
            changes = {"table": MOVING}
        elif verb == "supply.switch_on":
            changes = {"powered": True}
        elif verb == "chamber.command":
            changes = {"chamber_target_c": arguments["temperature_c"]}
        elif verb == "current_source.set_current":
            changes = {"current_ma": arguments["current_ma"]}
        self._link.note(verb, dict(arguments), **changes)
        if self._faults is not None:
            self._faults.strike(verb, arguments)

    def end(self, verb: str, failure: BaseException | None) -> None:
        """Note what became of a demand. One that was refused before anything moved changed nothing."""
        if verb in READS:
            return
        device, _, action = verb.partition(".")
        if failure is None:
            self._link.note(f"{verb}.done", {}, **self._done(device, action))
            return
        changes: dict[str, Any] = {}
        if action == "make_safe":
            changes = {"fault": f"{device}: {failure}"}
        elif isinstance(failure, OutOfRange):
            changes = {name: getattr(self._before, name) for name in REMEMBERED}
        self._note_quietly(f"{verb}.failed", {"error": f"{type(failure).__name__}: {failure}"}, changes)

    def asked(self, device: str) -> None:
        """A block is wanted: not noted, there are too many."""
        if self._faults is not None:
            self._faults.strike(f"{device}.block", {})

    def heard(self, device: str) -> None: ...

    def _done(self, device: str, action: str) -> dict[str, Any]:
        changes: dict[str, Any] = {}
        if device == "turntable" and action in ("move_to", "settle", "make_safe"):
            changes = {"table": AT_REST, "angles_deg": None}
            if action == "move_to":
                changes["angles_deg"] = tuple(self._arguments["turntable.move_to"]["angles_deg"])
        elif device == "supply" and action in ("switch_off", "make_safe"):
            changes = {"powered": False}
        elif device == "chamber" and action == "make_safe":
            changes = {"chamber_target_c": self._link.state.chamber_ambient_c}
        elif device == "current_source" and action == "make_safe":
            changes = {"current_ma": 0.0}
        if action == "make_safe":
            self._not_safe.discard(device)
            if not self._not_safe:
                changes["fault"] = ""
        return changes

    def _note_quietly(self, verb: str, arguments: dict[str, Any], changes: dict[str, Any]) -> None:
        """The failure that is being told matters more than a link that is gone by now."""
        if self._link.is_open:
            self._link.note(verb, arguments, **changes)


class RegisteredBench(ObservedBench):
    """A bench with the devices' link: as long as it is open, nobody else commands them."""

    def __init__(self, bench: Bench, link: DeviceLink, faults: DeviceFaults | None = None) -> None:
        devices = {"turntable", "supply"}
        devices |= {name for name in ("chamber", "current_source") if getattr(bench, name) is not None}
        super().__init__(bench, RegisterObserver(link, faults, frozenset(devices)))
        self._link = link

    def close(self) -> None:
        """Give the link back. A verb that is still under way finds it closed."""
        self._link.close()
        super().close()


class RegisteredDevices:
    """`bench_service.jobs.devices.BenchDevices` over a register: no world is needed, as no job is with real devices."""

    def __init__(self, register: DeviceRegister) -> None:
        self._register = register

    def device_state(self) -> DeviceState | None:
        return self._register.read()

    def make_safe(self, by: str) -> DeviceState:
        """Stop, lead to ambient, switch off. The simulated table of a dead process stops at once: where, is unknown."""
        state = self._register.read()
        if state is not None and state.safe:
            return state
        link = self._register.open(by)
        try:
            link.note("turntable.make_safe", {}, table=AT_REST, angles_deg=None)
            link.note("chamber.make_safe", {}, chamber_target_c=link.state.chamber_ambient_c)
            link.note("current_source.make_safe", {}, current_ma=0.0)
            link.note("supply.make_safe", {}, powered=False, fault="")
            return link.state
        finally:
            link.close()
