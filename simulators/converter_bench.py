"""Bench of the converter alone: how source, converter, chamber and supply are wired; knows none of their physics."""

from collections.abc import Callable

import numpy as np

from procedures.bench.errors import DeviceFault
from simulators.chamber.behaviour import converter_codes
from simulators.chamber.device import SimChamber
from simulators.chamber.network import CONVERTER
from simulators.clock import SimClock
from simulators.current_source.device import SimCurrentSource
from simulators.imu.converter_link import ConverterLink
from simulators.supply.device import SimSupply
from simulators.truth import BenchTruth, UnitTruth
from simulators.truth.thermal import THERMOMETERS

CONVERTER_SENSOR = THERMOMETERS.index("converter")


def current_source(bench: BenchTruth, seed: int, now_s: Callable[[], float]) -> SimCurrentSource:
    """Return the bench's current source. Raises `DeviceFault` where the bench declares none."""
    limits = bench.description.current_source
    if limits is None:
        raise DeviceFault(f"bench {bench.description.id!r} has no current source, and the job wants currents")
    return SimCurrentSource(bench.current_source, limits, seed, now_s)


def converter_alone(
    unit: UnitTruth, clock: SimClock, supply: SimSupply, chamber: SimChamber | None, source: SimCurrentSource
) -> ConverterLink:
    """Build the data link of a converter alone in the chamber, and connect it to clock and supply.

    The converter warms as it will in the unit (a stated choice). Raises `DeviceFault` where the world has no chamber.
    """
    if chamber is None:
        raise DeviceFault("a converter is tested over temperature: its stations must read temperatures")
    truths = unit.thermal.converter
    link = ConverterLink(
        unit, clock, supply.launch, lambda i, current, board: converter_codes(truths[i], current, board)
    )

    def advance(ticks: int) -> None:
        warmth = chamber.advance(ticks)
        if supply.is_on():
            board = np.append(warmth.before_c[CONVERTER], warmth.temperatures_c[:, CONVERTER])
            sent = np.append(warmth.codes_before[CONVERTER_SENSOR], warmth.codes[:, CONVERTER_SENSOR])
            lengths = np.diff([0, *warmth.end_ticks, ticks])
            link.feel(ticks, lambda: source.currents_ma(clock.ticks, ticks), lengths, board, sent)

    def power_up(launch: int) -> None:
        chamber.unit_power(True)
        link.power_up(launch)

    def power_down() -> None:
        chamber.unit_power(False)
        link.power_down()

    supply.connect(power_up, power_down)
    clock.connect(advance)
    return link
