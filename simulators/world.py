"""Entry point of the package: a whole simulated bench from its truth, a seed, and perhaps a checkpoint.

Knows how clock, table, supply, unit, chamber and operator are wired; knows none of their physics.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from itertools import pairwise
from typing import Any

import numpy as np

from procedures.bench import Bench
from procedures.bench.errors import DeviceFault, OtherVersion
from simulators.chamber.device import SimChamber, Warmth
from simulators.clock import SimClock, Wait
from simulators.converter_bench import converter_alone, current_source
from simulators.current_source.device import SimCurrentSource
from simulators.imu.climate import Climate, Drift
from simulators.imu.converter_link import ConverterLink
from simulators.imu.device import SimImu
from simulators.imu.sensor import TRIADS, Coefficients, launch_coefficients
from simulators.operator.person import SimOperator
from simulators.supply.device import SimSupply
from simulators.truth import Array, BenchTruth, UnitTruth, default_bench, default_unit
from simulators.turntable.device import SimTurntable

CHECKPOINT_VERSION = 3
WARM_SLICE_S = 60.0
"""Length of slices and blocks of a world with a chamber: a thermal run is half a day, at few samples a second."""

FOLLOWING_BLOCK_S = 0.5
"""Length of blocks of a world that follows another clock: shorter than anyone waits for a real unit."""


@dataclass(frozen=True)
class WorldConfig:
    """Configuration of a world: two truths, a seed, whether it has a chamber, and how fast time may pass."""

    unit: UnitTruth = field(default_factory=default_unit)
    bench: BenchTruth = field(default_factory=default_bench)
    seed: int = 1
    sample_rate_hz: float | None = None
    """Sample rate that replaces the unit's own [Hz]."""
    thermal: bool = False
    """True where the unit stands in the chamber and feels its temperature; else it is warm, at the reference."""
    currents: bool = False
    """True where a converter alone stands in the chamber, a current source on its inputs, instead of the whole unit."""
    real_time_factor: float | None = None
    """Number of bench seconds per real second; None: as fast as it can."""
    wait: Wait | None = field(default=None, repr=False)
    """Function that waits real seconds; needed with a real-time factor, and to follow a clock."""
    follows: Callable[[], float] | None = field(default=None, repr=False)
    """Bench time of the clock that the world follows, as beside real devices; None: it has a clock of its own."""

    @property
    def rate_hz(self) -> float:
        """Samples per second, which are also the clock's ticks [Hz]."""
        return self.unit.sample_rate_hz if self.sample_rate_hz is None else self.sample_rate_hz

    @property
    def slice_s(self) -> float | None:
        """Longest slice of time and longest block [s]; None: the clock's own."""
        if self.follows is not None:
            return FOLLOWING_BLOCK_S
        return WARM_SLICE_S if self.thermal and self.real_time_factor is None else None


@dataclass
class SimulatedBench(Bench):
    """A simulated bench that gives its truth, and that can be saved to a checkpoint and built from one."""

    config: WorldConfig = field(kw_only=True)
    clock: SimClock  # pyright: ignore[reportIncompatibleVariableOverride]
    turntable: SimTurntable  # pyright: ignore[reportIncompatibleVariableOverride]
    imu: SimImu | ConverterLink  # pyright: ignore[reportIncompatibleVariableOverride]
    supply: SimSupply  # pyright: ignore[reportIncompatibleVariableOverride]
    chamber: SimChamber | None = None  # pyright: ignore[reportIncompatibleVariableOverride]
    operator: SimOperator = field(kw_only=True)  # pyright: ignore[reportIncompatibleVariableOverride]
    current_source: SimCurrentSource | None = None  # pyright: ignore[reportIncompatibleVariableOverride]

    def checkpoint(self) -> dict[str, Any]:
        """State from which `build` continues, JSON-ready. Raises `DeviceFault` while the table moves."""
        return {
            "version": CHECKPOINT_VERSION,
            "seed": self.config.seed,
            "rate_hz": self.config.rate_hz,
            "ticks": self.clock.ticks,
            "turntable": self.turntable.checkpoint(),
            "supply": self.supply.checkpoint(),
            "imu": self.imu.checkpoint(),
            "operator": self.operator.checkpoint(),
            "chamber": None if self.chamber is None else self.chamber.checkpoint(),
            "current_source": None if self.current_source is None else self.current_source.checkpoint(),
        }

    def lost_links(self) -> frozenset[str]:
        """Names of devices whose link is lost for good: the chamber's by its fault `link_lost`, no other's."""
        return frozenset({"chamber"}) if self.chamber is not None and self.chamber.link_lost else frozenset()

    def true_calibration(self) -> dict[str, tuple[Array, Array]]:
        """Triad -> (bias (3,) [rate], K (3, 3)) of the present launch, of the first one before any: for tests."""
        return launch_truth(self.config, max(1, self.supply.launches))


def build(
    config: WorldConfig,
    checkpoint: Mapping[str, Any] | None = None,
    clock: SimClock | None = None,
    table: Callable[[BenchTruth, int, SimClock], SimTurntable] = SimTurntable,
) -> SimulatedBench:
    """Build a bench with the table at zero and the unit off, or as a checkpoint of the same seed and rate left it.

    `clock`: another one than the configuration's; `table`: makes the table.
    Raises `DeviceFault` where a chamber is wanted and the bench has none, `OtherVersion` for another's checkpoint.
    """
    if clock is None:
        clock = SimClock(config.rate_hz, config.real_time_factor, config.wait, config.slice_s, config.follows)
    turntable = table(config.bench, config.seed, clock)
    heat = config.unit.thermal.network
    load_w = heat.converter_w if config.currents else heat.power_w
    supply = SimSupply(clock.now_s, load_w, config.bench.description.supply)
    chamber = _chamber(config, clock) if config.thermal else None
    source = current_source(config.bench, config.seed, clock.now_s) if config.currents else None
    door = (lambda _is_open: None) if chamber is None else chamber.set_door
    operator = SimOperator(config.bench.operator, config.seed, clock, supply.is_on, door, turntable.place)
    if source is None:
        imu = _unit(config, clock, turntable, supply, chamber)
    else:
        imu = converter_alone(config.unit, clock, supply, chamber, source)
    bench = SimulatedBench(
        config.bench.description,
        clock,
        turntable,
        imu,
        supply,
        chamber,
        operator=operator,
        current_source=source,
        config=config,
    )
    if checkpoint is not None:
        _resume(bench, checkpoint)
    return bench


def _chamber(config: WorldConfig, clock: SimClock) -> SimChamber:
    truth, limits = config.bench, config.bench.description.chamber
    if limits is None:
        raise DeviceFault(f"bench {truth.description.id!r} has no thermal chamber, and the job reads temperatures")
    return SimChamber(
        truth.chamber, config.unit.thermal, config.seed, config.rate_hz, clock.now_s, truth.chamber_faults, limits
    )


def _unit(
    config: WorldConfig, clock: SimClock, table: SimTurntable, supply: SimSupply, chamber: SimChamber | None
) -> SimImu:
    """Build the whole unit, and connect it to table, supply and chamber."""
    imu = SimImu(config.unit, config.seed, clock, supply.launch, config.thermal, config.slice_s)
    if chamber is None:
        supply.connect(imu.power_up, imu.power_down)
        clock.connect(lambda ticks: imu.feel(table.advance(ticks)))
    else:
        _connect_warm(clock, table, supply, imu, chamber)
    return imu


def _connect_warm(clock: SimClock, table: SimTurntable, supply: SimSupply, imu: SimImu, chamber: SimChamber) -> None:
    """Connect unit and chamber: time that moves the unit also warms it, and its power heats it."""

    def advance(ticks: int) -> None:
        motion, warmth = table.advance(ticks), chamber.advance(ticks)
        if supply.is_on():
            imu.feel(motion, climate_of(chamber, warmth, ticks))

    def power_up(launch: int) -> None:
        chamber.unit_power(True)
        imu.power_up(launch)

    def power_down() -> None:
        chamber.unit_power(False)
        imu.power_down()

    supply.connect(power_up, power_down)
    clock.connect(advance)


def climate_of(chamber: SimChamber, warmth: Warmth, ticks: int) -> Climate:
    """Climate that the temperatures of some ticks make for the unit: the last second's until the next one ends."""
    felt = chamber.response(np.concatenate([warmth.before_c[None], warmth.temperatures_c]))
    edges = (0, *warmth.end_ticks, ticks)
    lengths = np.array([end - begin for begin, end in pairwise(edges)])
    gyro, gyro_added = None, felt.gyro_added_rad_s.T
    if np.any(gyro_added):
        same, none = np.ones_like(gyro_added), np.zeros_like(gyro_added)
        gyro = Drift(lengths, same, none, same, gyro_added)
    forces = (felt.sensor_gain, felt.sensor_added_m_s2, felt.converter_gain, felt.converter_added_m_s2)
    accelerometer = Drift(lengths, *(part.T for part in forces))
    return Climate(gyro, accelerometer, np.concatenate([warmth.codes_before[None], warmth.codes]))


def _resume(bench: SimulatedBench, checkpoint: Mapping[str, Any]) -> None:
    config = bench.config
    version = checkpoint.get("version")
    if version != CHECKPOINT_VERSION:
        raise OtherVersion(
            f"the simulated bench's state was stored by version {version} of the simulators, and these are version "
            f"{CHECKPOINT_VERSION}: a job cannot continue from it. Submit it again with the same seed, or resume it "
            "under the service that began it"
        )
    warm = checkpoint.get("chamber") is not None
    sourced = checkpoint.get("current_source") is not None
    made_with = (checkpoint["seed"], checkpoint["rate_hz"], warm, sourced)
    if made_with != (config.seed, config.rate_hz, config.thermal, config.currents):
        raise ValueError(f"the checkpoint was made with (seed, rate_hz, thermal, currents) = {made_with!r}")
    bench.clock.ticks = int(checkpoint["ticks"])
    bench.turntable.resume(checkpoint["turntable"])
    bench.supply.resume(checkpoint["supply"])
    bench.imu.resume(bench.supply.launch(), checkpoint["imu"])
    bench.operator.resume(checkpoint["operator"])
    if bench.chamber is not None:
        bench.chamber.resume(checkpoint["chamber"])
    if bench.current_source is not None:
        bench.current_source.resume(checkpoint["current_source"])


def launch_coefficients_of(config: WorldConfig, launch: int = 1) -> dict[str, Coefficients]:
    """Triad -> everything that is true of it during a launch, the even terms included."""
    return {name: launch_coefficients(config.unit.triad(name), config.seed, launch, name) for name in TRIADS}


def launch_truth(config: WorldConfig, launch: int = 1) -> dict[str, tuple[Array, Array]]:
    """Triad -> (bias (3,) [rad/s or m/s²], K (3, 3)) of a launch, without running anything."""
    return {name: (c.bias, c.matrix) for name, c in launch_coefficients_of(config, launch).items()}
