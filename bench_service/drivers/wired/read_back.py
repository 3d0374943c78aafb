"""Readings of devices against what they should be: safe, or as their register has them. Sentences; commands nothing."""

from typing import Any

from bench_service.bench.device_log import tolerance_deg
from bench_service.bench.devices import AT_REST, MOVING, DeviceState
from bench_service.drivers.interface.driver import Kind
from bench_service.drivers.interface.sections import ChamberSection, DeviceSection
from procedures.analysis.measured_stations import angle_difference_deg
from procedures.bench import BenchDescription
from procedures.bench.chamber import ChamberReading
from procedures.bench.current_source import CurrentSourceReading
from procedures.bench.supply import SupplyReading
from procedures.bench.turntable import TableReading

SET_POINT_C = 0.11
"""Largest difference of two set points that count as equal, for chambers have tenths of a degree [°C]."""
CURRENT_MA = 1e-3
"""Largest difference of two current settings that count as equal [mA]."""


def unsafe_reading(kind: Kind, section: DeviceSection, reading: Any) -> str:
    """Return the reason why a device that was made safe reads back as unsafe; empty: it is safe."""
    if isinstance(reading, TableReading) and reading.moving:
        return "the turntable still moves"
    if isinstance(reading, SupplyReading) and reading.on:
        return f"the supply still gives {reading.voltage_v:g} V"
    if isinstance(reading, CurrentSourceReading) and abs(reading.set_ma) > CURRENT_MA:
        return f"the current source still gives {reading.set_ma:g} mA"
    if isinstance(reading, ChamberReading) and isinstance(section, ChamberSection):
        return _unsafe_chamber(section, reading)
    return ""


def _unsafe_chamber(section: ChamberSection, reading: ChamberReading) -> str:
    target = reading.target_c
    if target is None or section.on_safe == "hold":
        return ""
    if section.on_safe == "off":
        return f"the chamber still runs, to {target:g} °C"
    ambient = None if section.limits is None else section.limits.ambient_c
    if ambient is not None and abs(target - ambient) > SET_POINT_C:
        return f"the chamber is still commanded to {target:g} °C, and not to {ambient:g}"
    return ""


def differences(state: DeviceState, readings: dict[Kind, Any], description: BenchDescription) -> tuple[str, ...]:
    """Return the differences between the register and the devices themselves, a sentence each.

    Angles are compared to within the table's accuracy; whole turns count, except of an axis that turns endlessly.
    """
    found: list[str] = []
    for reading in readings.values():
        if isinstance(reading, TableReading):
            found += _table(state, reading, description)
        elif isinstance(reading, SupplyReading) and reading.on != state.powered:
            found.append(f"the supply is {_on(reading.on)}, and was left {_on(state.powered)}")
        elif isinstance(reading, CurrentSourceReading) and abs(reading.set_ma - state.current_ma) > CURRENT_MA:
            found.append(f"the current source gives {reading.set_ma:g} mA, and was left at {state.current_ma:g} mA")
        elif isinstance(reading, ChamberReading):
            found += _chamber(state, reading)
    return tuple(found)


def as_read(readings: dict[Kind, Any]) -> dict[str, Any]:
    """Return the fields of the register as the devices' readings give them."""
    changes: dict[str, Any] = {}
    for reading in readings.values():
        if isinstance(reading, TableReading):
            a = reading.angles
            known = reading.homed and not reading.moving
            changes["table"] = MOVING if reading.moving else AT_REST
            changes["angles_deg"] = (a.outer_deg, a.middle_deg, a.inner_deg) if known else None
        elif isinstance(reading, SupplyReading):
            changes["powered"] = reading.on
        elif isinstance(reading, CurrentSourceReading):
            changes["current_ma"] = 0.0 if abs(reading.set_ma) <= CURRENT_MA else reading.set_ma
        elif isinstance(reading, ChamberReading):
            changes["chamber_target_c"] = reading.target_c
    return changes


def _on(on: bool) -> str:
    return "on" if on else "off"


def _chamber(state: DeviceState, reading: ChamberReading) -> list[str]:
    """Faults of the chamber's set point. A chamber that stands still has none, whatever was commanded: a limiter may
    have stopped it.
    """
    if reading.target_c is None or (
        state.chamber_target_c is not None and abs(reading.target_c - state.chamber_target_c) <= SET_POINT_C
    ):
        return []
    left = "standing still" if state.chamber_target_c is None else f"commanded to {state.chamber_target_c:g} °C"
    return [f"the chamber is commanded to {reading.target_c:g} °C, and was left {left}"]


def _table(state: DeviceState, reading: TableReading, description: BenchDescription) -> list[str]:
    if not reading.homed:
        return ["the turntable is not homed: its angles are not known until a person has homed it"]
    if reading.moving and state.table == AT_REST:
        return ["the turntable moves, and was left at rest"]
    if state.angles_deg is None or reading.moving:
        return []
    found: list[str] = []
    most = tolerance_deg(description.accuracy)
    for axis, left in zip(("outer", "middle", "inner"), state.angles_deg, strict=True):
        shown = getattr(reading.angles, f"{axis}_deg")
        endless = getattr(description, axis).continuous
        off = angle_difference_deg(shown, left) if endless else shown - left
        if not abs(off) <= most:
            found.append(f"the {axis} axis of the turntable stands at {shown:.4f} deg, and was left at {left:g}")
    return found
