"""Driver of the simulated bench: the only file that imports the simulators."""

import re
from collections.abc import Callable, Iterator
from dataclasses import replace
from importlib import import_module
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeVar

from bench_service.bench.devices import DeviceState
from bench_service.bench.driver import TrueTriad
from bench_service.bench.prompts import Asking
from bench_service.drivers.device_faults import DeviceFaults, FaultPlan
from bench_service.drivers.device_register import DeviceRegister
from bench_service.drivers.registered import RegisteredBench, RegisteredDevices
from bench_service.model.errors import Misconfigured, NotMounted
from bench_service.wall_clock import pause_async
from procedures.bench import Bench, BenchDescription, BenchNeeds, Clock
from procedures.bench.errors import BenchError
from procedures.core.arrays import Array
from procedures.core.noise import NoiseCoefficients
from procedures.core.unit import Unit
from procedures.importing import IMPORTING
from simulators.truth import (
    BenchTruth,
    UnitTruth,
    declared_unit,
    default_bench,
    default_unit,
    load_bench,
    load_unit,
    random_unit_truth,
)

if TYPE_CHECKING:
    from simulators.world import SimulatedBench, WorldConfig

RANDOM_UNIT = re.compile(r"^RANDOM-(\d{1,9})$")
"""Serial of a unit whose truth is drawn from the number in it: as many different units as a test needs."""


T = TypeVar("T")


def _loaded(path: Path, load: Callable[[Path], T]) -> T:
    """Load a truth file. Raises `Misconfigured` naming it."""
    try:
        return load(path)
    except (OSError, ValueError, TypeError) as error:
        raise Misconfigured(f"{path}: {error}") from error


def _shipped_as(bench_id: str) -> BenchTruth:
    """Return the shipped bench under another id; the unit on each of them is the same."""
    shipped = default_bench()
    return replace(shipped, description=replace(shipped.description, id=bench_id))


class SimulatedDriver:
    """A bench whose table, unit, supply and chamber live in this process; its data are marked as simulated."""

    def __init__(
        self,
        bench_id: str,
        unit_truth: Path | None = None,
        bench_truth: Path | None = None,
        real_time_factor: float | None = None,
        register: DeviceRegister | None = None,
        faults: FaultPlan | None = None,
        asking: Asking | None = None,
    ) -> None:
        """Without a truth file a bench of any id is the shipped one under that id: a laboratory may have several.

        `register`: keeps the devices' state beyond this process; without one, no other process can make them safe.
        `asking`: asks a person for each action that the simulated operator would otherwise do at once.
        Raises `Misconfigured` for a truth file that cannot be used, `NotMounted` for one of another bench.
        """
        self._asking = asking
        self._bench = _shipped_as(bench_id) if bench_truth is None else _loaded(bench_truth, load_bench)
        self._unit = default_unit() if unit_truth is None else _loaded(unit_truth, load_unit)
        self._real_time_factor = real_time_factor
        self._register = register
        self._faults = faults
        if bench_id != self._bench.description.id:
            raise NotMounted(f"the truth file is of bench {self._bench.description.id!r}, not {bench_id!r}")

    @property
    def description(self) -> BenchDescription:
        return self._bench.description

    def mounted(self, serial: str | None = None) -> tuple[Unit, ...]:
        """Return the unit of the truth file, and the drawn unit of a serial like RANDOM-7 where it is asked for."""
        units = [self._unit]
        if serial is not None and RANDOM_UNIT.match(serial):
            units.append(self._truth_of(serial))
        return tuple(declared_unit(unit) for unit in units)

    def open(
        self,
        unit: str,
        seed: int | None,
        checkpoint: dict[str, Any] | None,
        needs: BenchNeeds,
        job: str | None = None,
    ) -> Bench:
        """A world with that unit on the table, at its beginning or at a checkpoint; with its chamber where needed.

        Raises `NotMounted`, `DeviceBusy`, `DeviceFault` where the job reads temperatures and the bench has no chamber.

        `seed` None: 0. `checkpoint` None: the beginning. `job`: id of the job that takes the link, None outside of
        jobs.
        """
        with IMPORTING:
            from simulators.world import build  # with MuJoCo: not needed before a bench is opened

        self.warm_up()  # a job that came before the service's own warm-up would do it during its first demand
        config = replace(
            self._config(unit, 0 if seed is None else seed),
            sample_rate_hz=needs.sample_rate_hz,
            thermal=needs.temperatures,
            currents=needs.currents,
        )
        if needs.real_time and config.real_time_factor is None:
            config = replace(config, real_time_factor=1.0)
        bench = build(config, checkpoint)
        if self._register is None:
            return bench
        link = self._register.open(job=job)
        chamber = self.description.chamber
        link.note("bench.opened", {"unit": unit}, chamber_ambient_c=None if chamber is None else chamber.ambient_c)
        cables = self._register.cables
        faults = None if self._faults is None else DeviceFaults(self._faults, f"{job} {link.openings}", cables)
        return self._asked(RegisteredBench(bench, link, cables, faults, bench.lost_links), job)

    def warm_up(self) -> None:
        """Load the filter of the unit's noise: half a second, of which the watchdog would see a table that hangs."""
        with IMPORTING:
            import_module("scipy.signal")

    def world(
        self, unit: str, seed: int, needs: BenchNeeds, description: BenchDescription, clock: Clock
    ) -> "SimulatedBench":
        """A world that stands beside real devices and follows their clock; a unit that it does not have is the default.

        `description`: the limits of the mixed bench, to which its simulated devices hold.
        """
        with IMPORTING:
            from simulators.world import WorldConfig, build

        self.warm_up()
        known = unit == self._unit.serial or _drawn_truth(unit) is not None
        return build(
            WorldConfig(
                unit=self._truth_of(unit) if known else self._unit,
                bench=replace(self._bench, description=description),
                seed=seed,
                sample_rate_hz=needs.sample_rate_hz,
                thermal=needs.temperatures,
                currents=needs.currents,
                wait=pause_async,
                follows=clock.now_s,
            )
        )

    def _asked(self, bench: Bench, job: str | None) -> Bench:
        """Replace the simulated operator by a person in the bench that is shown; the world within keeps its own."""
        if self._asking is not None and job is not None:
            bench.operator = self._asking(job, bench.operator)
        return bench

    def device_state(self) -> DeviceState | None:
        """Return the devices' last noted state from the register; None without a register."""
        return None if self._register is None else RegisteredDevices(self._register).device_state()

    def compare(self, by: str) -> tuple[str, ...]:
        """Return no differences: simulated devices are as their register says."""
        return ()

    def make_safe(self, by: str) -> DeviceState:
        """Make the devices safe by the register, without a world, and return their state. Raises `DeviceBusy`;
        `BenchError` without register.
        """
        if self._register is None:
            raise BenchError(
                "this bench has no device register: only the job that drives the bench can stop its devices"
            )
        return RegisteredDevices(self._register).make_safe(by)

    def truth(self, unit: str, seed: int) -> tuple[TrueTriad, ...]:
        """Return bias and matrix of each triad in the job's launch, at the unit's reference temperature, run-to-run
        changes included.
        """
        with IMPORTING:
            from simulators.world import launch_truth

        found = launch_truth(self._config(unit, seed))
        units = {"gyro": "rad/s", "accelerometer": "m/s^2"}
        return tuple(
            TrueTriad(
                triad,
                units[triad],
                tuple(float(b) for b in bias),
                tuple(tuple(float(k) for k in row) for row in matrix),
            )
            for triad, (bias, matrix) in found.items()
        )

    def _config(self, unit: str, seed: int) -> "WorldConfig":
        with IMPORTING:
            from simulators.world import WorldConfig

        return WorldConfig(
            unit=self._truth_of(unit),
            bench=self._bench,
            seed=seed,
            real_time_factor=self._real_time_factor,
            wait=pause_async,
        )

    def _truth_of(self, serial: str) -> UnitTruth:
        if serial == self._unit.serial:
            return self._unit
        drawn = _drawn_truth(serial)
        if drawn is None:
            raise NotMounted(
                f"the simulated bench has no unit {serial!r}; it has {self._unit.serial} and RANDOM-<number>"
            )
        return drawn


def drawn_unit(serial: str) -> Unit | None:
    """Return the unit of a serial like RANDOM-7, drawn from it, which every simulated bench has; None for another
    serial.
    """
    truth = _drawn_truth(serial)
    return None if truth is None else declared_unit(truth)


def _drawn_truth(serial: str) -> UnitTruth | None:
    found = RANDOM_UNIT.match(serial)
    return None if found is None else replace(random_unit_truth(int(found.group(1))), serial=serial)


def synthetic_rates(noise: NoiseCoefficients, rate_hz: float, count: int, seed: int) -> Iterator[Array]:
    """Yield blocks of rates of a chosen noise, (n,), for synthetic recordings."""
    with IMPORTING:
        from simulators.imu.synthesis import synthesise

    return synthesise(noise, rate_hz, count, seed)
