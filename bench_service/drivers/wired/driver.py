"""Driver of a bench that a bench file describes: real devices, and simulated ones beside them."""

import logging
from collections.abc import Callable, Mapping
from dataclasses import replace
from typing import Any

from bench_service.bench.devices import DeviceState
from bench_service.bench.driver import TrueTriad
from bench_service.bench.observed import ObservedBench
from bench_service.bench.prompts import Asking
from bench_service.drivers.bench_file.description import described
from bench_service.drivers.bench_file.document import BenchFile
from bench_service.drivers.bench_file.unit_files import read_units
from bench_service.drivers.device_register import DeviceLink, DeviceRegister
from bench_service.drivers.interface.driver import DriverContext, Found, Kind
from bench_service.drivers.interface.sections import EnvironmentSection, Wire
from bench_service.drivers.registered import RegisteredBench
from bench_service.drivers.simulated import SimulatedDriver
from bench_service.drivers.wall_bench_clock import WallBenchClock
from bench_service.drivers.wired.devices import WiredDevices, safe_state
from bench_service.drivers.wired.entered_environment import EnteredEnvironment
from bench_service.drivers.wired.guarded import LaunchedUnit, LaunchingSupply, ready_of
from bench_service.drivers.wired.mixed import CatchUp, MixedClock, TwinSupply, TwinTurntable
from bench_service.drivers.wired.mixed_air import AiredClock, AiredUnit, RealAir
from bench_service.drivers.wired.opening import opened, survey
from bench_service.drivers.wired.parallel import named
from bench_service.drivers.wired.served_person import ServedPerson
from bench_service.model.errors import NotMounted
from procedures.bench import Bench, BenchDescription, BenchNeeds, Clock, Environment, Operator
from procedures.bench.errors import DeviceFault, Disconnected
from procedures.core.unit import Unit

log = logging.getLogger(__name__)
REAL_UNIT: tuple[Kind, ...] = ("turntable", "supply", "unit_link")
"""Devices without which no job runs."""


class WiredBench(RegisteredBench):
    """A bench with real devices during a job; closing it drops their links."""

    def __init__(
        self,
        bench: Bench,
        link: DeviceLink,
        register: DeviceRegister,
        safe: Callable[[str, DeviceState], dict[str, Any]],
        devices: Mapping[Kind, Any],
    ) -> None:
        super().__init__(bench, link, register.cables, safe_state=safe)
        self._devices = devices

    def close(self) -> None:
        """Drop the devices' links, then release the register's link."""
        for device in self._devices.values():
            device.close()
        super().close()


class BenchFileDriver:
    """Driver of a bench that a bench file describes, real and simulated devices mixed. Implements
    `bench_service.bench.driver.BenchDriver`.
    """

    def __init__(
        self, file: BenchFile, simulated: SimulatedDriver, register: DeviceRegister, asking: Asking | None
    ) -> None:
        """Ask the devices who they are; one that does not answer is asked again when a job opens the bench.

        Raises `Misconfigured` for a unit's file that cannot be used.
        """
        self._file = file
        self._simulated = simulated
        self._register = register
        self._asking = asking
        self._units = read_units(file.folder / "units")
        self._found: dict[Kind, Found] = {}
        self._told: set[str] = set()
        self._devices = WiredDevices(lambda: file, register)
        self._description = described(file, simulated.description)
        for kind, failure in self._look().items():
            log.warning("bench %s: the %s is not reached: %s", file.id, named(kind), failure)

    @property
    def description(self) -> BenchDescription:
        return self._description

    def mounted(self, serial: str | None = None) -> tuple[Unit, ...]:
        """Return the units that have a file; those of the simulation where the unit is simulated."""
        return self._simulated.mounted(serial) if self._file.within("unit_link") else self._units

    def open(
        self,
        unit: str,
        seed: int | None,
        checkpoint: dict[str, Any] | None,
        needs: BenchNeeds,
        job: str | None = None,
    ) -> Bench:
        """Open the bench for a job. Real time continues while a service is down: there is nothing to continue from, and
        `checkpoint` is not used. `seed`: of the simulated devices, None: 0. `job`: id of the job that takes the link.

        Raises `NotMounted`, `DeviceBusy`, `Disconnected` naming the devices that do not answer, and `DeviceFault` where
        a job needs what this bench cannot do, or where another device than before answers.
        """
        if needs.temperatures and (reason := self._description.no_thermal_jobs):
            raise DeviceFault(reason)
        if needs.temperatures and "chamber" not in self._file.devices:
            raise DeviceFault(f"bench {self._file.id!r} has no thermal chamber, and the job reads temperatures")
        declared = next((u for u in self.mounted(unit) if u.serial == unit), None)
        if declared is None:
            there = ", ".join(u.serial for u in self.mounted()) or f"none in {self._file.folder / 'units'}"
            raise NotMounted(f"bench {self._file.id!r} has no unit {unit!r}; it has {there}")
        link = self._register.open(job=job)
        try:
            self._need_devices(needs)
            return self._opened(declared, 0 if seed is None else seed, needs, job, link)
        except BaseException:
            link.close()
            raise

    def warm_up(self) -> None:
        """Load what a simulated unit needs, where the bench file has one."""
        if self._file.within("unit_link"):
            self._simulated.warm_up()

    def _need_devices(self, needs: BenchNeeds) -> None:
        before = dict(self._found)
        failures = self._look()
        needed = {*REAL_UNIT, *(("chamber",) if needs.temperatures or needs.currents else ())}
        needed |= {"current_source"} if needs.currents else set()
        silent = {kind: failure for kind, failure in failures.items() if kind in needed}
        if silent:
            raise Disconnected("; ".join(f"the {named(k)} is not reached: {f}" for k, f in silent.items()))
        for kind, found in self._found.items():
            old = before.get(kind)
            if old is not None and old.identity.serial != found.identity.serial:
                raise DeviceFault(
                    f"the {named(kind)} is {found.identity}, and was {old.identity} when the job was planned: "
                    "submit the job again"
                )

    def _look(self) -> Mapping[Kind, Exception]:
        """Ask the devices for identity and limits; returns the failures, and describes the bench again."""
        found = survey(self._file)
        self._found |= found.found
        for sentence in found.limit_differences(self._file):
            if sentence not in self._told:  # it is asked before each job, and differs but rarely
                log.warning("bench %s: %s", self._file.id, sentence)
            self._told.add(sentence)
        self._description = described(self._file, self._simulated.description, self._found)
        return found.failures

    def _opened(self, unit: Unit, seed: int, needs: BenchNeeds, job: str | None, link: DeviceLink) -> Bench:
        wall, file, description = WallBenchClock(factor=self._file.time_factor), self._file, self._description
        context = DriverContext(
            *(file.id, wall, file.folder, unit, lambda: link.state.powered),
            note=lambda e, more: self._note(job, e, more),
            time_factor=file.time_factor,
        )
        kinds: list[Kind] = [kind for kind in file.real() if _is_wanted(kind, needs)]
        devices = opened(file, kinds, context)
        bench = Bench(description, wall, *(devices.get(kind) for kind in ("turntable", "unit_link", "supply")))  # pyright: ignore[reportArgumentType]
        bench.chamber, bench.current_source = devices.get("chamber"), devices.get("current_source")
        if any(file.within(kind) for kind in ("turntable", "unit_link", "supply", "chamber", "current_source")):
            self._add_simulated(bench, unit.serial, seed, needs, wall)
        if not file.within("unit_link"):
            supply = LaunchingSupply(bench.supply, bench.clock.now_s, ready_of(bench.imu))
            bench.supply, bench.imu = supply, LaunchedUnit(bench.imu, supply)  # pyright: ignore[reportAttributeAccessIssue]
        bench.operator = self._operator(bench.operator, job)
        bench.safe_s = {k: s.safe_s for k, s in file.real().items() if isinstance(s, Wire)}
        bench.environment = self._environment(devices, bench.clock)
        chamber = description.chamber
        ambient = None if chamber is None else chamber.ambient_c
        link.note(
            "bench.opened", {"unit": unit.serial}, chamber_ambient_c=ambient, bench_file=str(file.path.absolute())
        )
        return WiredBench(bench, link, self._register, self._safe_state, devices)

    def _add_simulated(self, bench: Bench, unit: str, seed: int, needs: BenchNeeds, wall: WallBenchClock) -> None:
        """Fill the places of simulated devices from one world, and let it feel the real ones."""
        has_table = not self._file.within("turntable")
        description = _free_axes(self._description) if has_table else self._description
        world = self._simulated.world(unit, seed, needs, description, wall)
        seen = ObservedBench(world, CatchUp(world.clock))
        bench.clock = clock = MixedClock(wall, world.clock)
        simulated_unit = self._file.within("unit_link")
        bench.turntable = _or_twin(bench.turntable, seen.turntable, world.turntable, simulated_unit, TwinTurntable)
        bench.supply = _or_twin(bench.supply, seen.supply, world.supply, simulated_unit, TwinSupply)
        bench.imu = bench.imu or seen.imu
        if self._file.within("chamber"):
            bench.chamber = seen.chamber
        elif simulated_unit and bench.chamber is not None and world.chamber is not None:
            air = RealAir(bench.chamber, clock, world.chamber.follow)
            bench.clock, bench.imu = AiredClock(clock, air), AiredUnit(bench.imu, air)  # pyright: ignore[reportAttributeAccessIssue]
        if self._file.within("current_source"):
            bench.current_source = seen.current_source
        bench.operator = seen.operator

    def _operator(self, simulated: Operator | None, job: str | None) -> Operator | None:
        """A person who is asked where the file says so; else the simulated one, in this process or at its address."""
        section = self._file.rest.operator
        served = None if section.address is None else ServedPerson(section.address)
        if section.driver == "asked":
            return None if self._asking is None or job is None else self._asking(job, served)
        return served or simulated

    def _environment(self, devices: Mapping[Kind, Any], clock: Clock) -> Environment | None:
        """A sensor of the room, or the values that were entered."""
        section = self._file.devices.get("environment")
        if not isinstance(section, EnvironmentSection):
            return None
        return devices.get("environment") or EnteredEnvironment(section, clock)

    def _safe_state(self, device: str, state: DeviceState) -> dict[str, Any]:
        section = next((s for kind, s in self._file.devices.items() if kind == device), None)
        return safe_state(device, section, state)

    def _note(self, job: str | None, event: str, more: Mapping[str, Any]) -> None:
        self._register.journal.write(event, more, job=job)

    def device_state(self) -> DeviceState | None:
        """Return the devices' last noted state from the register; asks no device. None: no process of this host ever
        had the link.
        """
        return self._devices.device_state()

    def compare(self, by: str) -> tuple[str, ...]:
        """Compare the devices with their register and return the differences; see `WiredDevices.compare`."""
        return self._devices.compare(by)

    def make_safe(self, by: str) -> DeviceState:
        """Make the devices safe without a job, and return their state; see `WiredDevices.make_safe`."""
        return self._devices.make_safe(by)

    def truth(self, unit: str, seed: int) -> tuple[TrueTriad, ...]:
        """Return nothing: of a bench with real devices no true values are known."""
        return ()


def _free_axes(description: BenchDescription) -> BenchDescription:
    """The description for a simulated table that only repeats a real one, which keeps the limits itself."""
    outer, middle, inner = (
        replace(axis, minimum_deg=axis.minimum_deg - 1.0, maximum_deg=axis.maximum_deg + 1.0)
        for axis in (description.outer, description.middle, description.inner)
    )
    return replace(description, outer=outer, middle=middle, inner=inner)


def _is_wanted(kind: Kind, needs: BenchNeeds) -> bool:
    """Return whether a job needs a device: a chamber that it does not use is left alone."""
    if kind == "chamber":
        return needs.temperatures or needs.currents
    return kind != "current_source" or needs.currents


def _or_twin(real: Any, seen: Any, below: Any, unit_simulated: bool, twin: Callable[[Any, Any], Any]) -> Any:
    """The simulated device where there is no real one; the real one with its twin where the unit is simulated."""
    if real is None:
        return seen
    return twin(real, below) if unit_simulated else real
