"""Description of a bench from its file: limits, accuracy, site, and its devices with their certificates."""

from collections.abc import Callable, Mapping
from dataclasses import replace

from bench_service.drivers.bench_file.document import BenchFile
from bench_service.drivers.interface.driver import Found, Kind, narrowed
from bench_service.drivers.interface.sections import (
    Accuracy,
    Axis,
    Certificate,
    ChamberSection,
    CurrentSourceSection,
    DeviceSection,
    SupplySection,
    TurntableSection,
    Wire,
)
from procedures.bench import BenchDescription
from procedures.bench.chamber import ChamberAccuracy, ChamberLimits
from procedures.bench.current_source import CurrentSourceLimits
from procedures.bench.declared_device import DeclaredCertificate, DeclaredDevice
from procedures.bench.description import AxisLimits, TableAccuracy
from procedures.bench.supply import SupplyLimits
from procedures.core.site import Site

NO_ANGLES = AxisLimits(0.0, 0.0, 1.0, 1.0)
AXES = ("outer", "middle", "inner")

MOST_TURN_EXTRA_S = 60.0
"""Longest time of a table's demands for whole turns [s, bench time]: half of it is before the turns, when the unit's
data wait (`bench_service.drivers.devices.unit_recordings.HELD_S`).
"""

AFTER_DEMAND = "after_demand_s"
"""Setting of a table's driver whose controller needs a pause after each demand."""


def described(
    file: BenchFile, simulated: BenchDescription | None, found: Mapping[Kind, Found] | None = None
) -> BenchDescription:
    """Return the description of the bench: limits, accuracy, site, devices with their certificates.

    `simulated`: the description of the simulated devices, None where there are none. `found`: findings of the devices
    that were reached; the narrower of their limits and the file's hold.
    """
    told = found or {}
    sections = {
        kind: narrowed(section, told[kind].limits) if kind in told else section
        for kind, section in file.devices.items()
    }
    rest = file.rest
    site = {name: getattr(rest.site, name) for name in type(rest.site).model_fields if name != "certificate"}
    outer, middle, inner = _axes(sections["turntable"], simulated)
    table = sections["turntable"]
    assert isinstance(table, TurntableSection)
    real_table = isinstance(table, Wire)
    extra_s = table.turn_extra_s(file.time_factor) if real_table else 0.0
    accuracy = _accuracy(table.accuracy) if real_table or simulated is None else simulated.accuracy
    return BenchDescription(
        rest.bench.id,
        Site(**site),
        outer,
        middle,
        inner,
        accuracy,
        simulated=any(file.simulated(kind) for kind in ("turntable", "supply", "unit_link", "chamber")),
        title=rest.bench.title,
        chamber=_chamber(sections.get("chamber"), simulated),
        chamber_accuracy=_chamber_accuracy(sections.get("chamber"), simulated),
        current_source=_current(sections.get("current_source"), simulated),
        supply=_supply(sections["supply"], simulated),
        sinusoidal=table.sinusoidal if real_table or simulated is None else simulated.sinusoidal,
        turn_extra_s=extra_s,
        no_turns=_no_turns(file, extra_s),
        devices=_devices(file, told),
        expired_certificates=rest.policy.expired_certificate,
        no_thermal_jobs=_no_thermal_jobs(file),
    )


def _no_turns(file: BenchFile, extra_s: float) -> str:
    """The reason why no job with whole turns runs: the table's demands take too long."""
    if extra_s <= MOST_TURN_EXTRA_S:
        return ""
    table = file.devices["turntable"]
    assert isinstance(table, TurntableSection)
    return (
        f"{_cause(file, table)}: whole turns would take {extra_s:.0f} s of bench time for the table's demands alone, "
        f"more than {MOST_TURN_EXTRA_S:g} s{_way_out(file, table)}"
    )


def _cause(file: BenchFile, table: TurntableSection) -> str:
    """The setting that makes demands slow: the time factor of served simulators, else the pause after a demand."""
    pause_s = getattr(table, AFTER_DEMAND, None)
    if file.time_factor > 1.0 or pause_s is None:
        return f"simulation.time_factor = {file.time_factor:g}"
    return f"turntable.{AFTER_DEMAND} = {pause_s:g}"


def _way_out(file: BenchFile, table: TurntableSection) -> str:
    """The largest time factor that lets whole turns run, or, at that of real devices, the longest pause; or nothing."""
    factor = _largest(1.0, file.time_factor, table.turn_extra_s)
    if factor is not None:
        return f"; a factor of at most {factor:g} lets them run"

    def extra_s(after_demand_s: float) -> float:
        return table.model_copy(update={AFTER_DEMAND: after_demand_s}).turn_extra_s(file.time_factor)

    pause_s = _largest(0.0, getattr(table, AFTER_DEMAND, 0.0), extra_s)
    if pause_s is None:
        return ""
    most = f"turntable.{AFTER_DEMAND} of at most {pause_s:g} s"
    return f"; {most} lets them run, where the controller takes demands so fast"


def _largest(least: float, below: float, extra_s: Callable[[float], float]) -> float | None:
    """Largest setting, in tenths, at which the table's demands for whole turns take no longer than they may."""
    tenths = range(round(10.0 * below) - 1, round(10.0 * least) - 1, -1)
    return next((tenth / 10.0 for tenth in tenths if extra_s(tenth / 10.0) <= MOST_TURN_EXTRA_S), None)


def _no_thermal_jobs(file: BenchFile) -> str:
    """The reason why no job that reads temperatures runs on a bench whose real unit feels no air.

    A simulated unit follows the air of a real chamber (`bench_service.drivers.wired.mixed_air`).
    """
    if "chamber" not in file.devices or file.within("unit_link") or not file.within("chamber"):
        return ""
    return "the unit is real and the chamber is simulated: nothing warms or cools the unit"


def _axes(section: DeviceSection, simulated: BenchDescription | None) -> tuple[AxisLimits, ...]:
    """Limits of the three axes; those of a simulated table are the narrower of its own and the file's."""
    limits: list[AxisLimits] = []
    for name in AXES:
        axis: Axis | None = getattr(section, name)
        own = None if simulated is None or isinstance(section, Wire) else getattr(simulated, name)
        if axis is None:
            limits.append(NO_ANGLES if own is None else own)
            continue
        declared = AxisLimits(**axis.model_dump(exclude={"number"}))
        limits.append(declared if own is None else _narrower(declared, own))
    return tuple(limits)


def _narrower(declared: AxisLimits, own: AxisLimits) -> AxisLimits:
    return replace(
        declared,
        minimum_deg=max(declared.minimum_deg, own.minimum_deg),
        maximum_deg=min(declared.maximum_deg, own.maximum_deg),
        rate_deg_s=min(declared.rate_deg_s, own.rate_deg_s),
        acceleration_deg_s2=min(declared.acceleration_deg_s2, own.acceleration_deg_s2),
        continuous=declared.continuous and own.continuous,
    )


def _accuracy(given: Accuracy) -> TableAccuracy:
    """Accuracy of the angles that analyses use: the encoders' where they are declared as the better witness."""
    encoder = given.encoder_sd_arcsec
    measured = encoder is not None and encoder < given.pointing_sd_arcsec
    pointing = encoder if measured and encoder is not None else given.pointing_sd_arcsec
    return TableAccuracy(given.orthogonality_sd_arcsec, pointing, given.level_sd_arcsec, measured)


def _chamber(section: DeviceSection | None, simulated: BenchDescription | None) -> ChamberLimits | None:
    if not isinstance(section, ChamberSection):
        return None
    own = None if simulated is None or isinstance(section, Wire) else simulated.chamber
    if section.limits is None:
        return own
    declared = ChamberLimits(**section.limits.model_dump())
    if own is None:
        return declared
    return ChamberLimits(
        max(declared.minimum_c, own.minimum_c),
        min(declared.maximum_c, own.maximum_c),
        min(declared.ramp_c_min, own.ramp_c_min),
        own.ambient_c,
    )


def _chamber_accuracy(section: DeviceSection | None, simulated: BenchDescription | None) -> ChamberAccuracy | None:
    """Accuracy as the section declares it, else that of a simulated chamber."""
    if not isinstance(section, ChamberSection):
        return None
    if section.accuracy is not None:
        return ChamberAccuracy(**section.accuracy.model_dump())
    return None if simulated is None or isinstance(section, Wire) else simulated.chamber_accuracy


def _supply(section: DeviceSection, simulated: BenchDescription | None) -> SupplyLimits | None:
    if isinstance(section, SupplySection) and section.limits is not None:
        return SupplyLimits(**section.limits.model_dump())
    return None if simulated is None else simulated.supply


def _current(section: DeviceSection | None, simulated: BenchDescription | None) -> CurrentSourceLimits | None:
    if not isinstance(section, CurrentSourceSection):
        return None
    if section.limits is not None:
        return CurrentSourceLimits(**section.limits.model_dump())
    return None if simulated is None else simulated.current_source


def _devices(file: BenchFile, found: Mapping[Kind, Found]) -> tuple[DeclaredDevice, ...]:
    devices = [
        DeclaredDevice(
            kind,
            file.simulated(kind),
            section.driver,
            str(section.address) if isinstance(section, Wire) else "",
            found[kind].identity if kind in found else None,
            _certificate(section.certificate),
        )
        for kind, section in file.devices.items()
    ]
    operator = file.rest.operator
    devices.append(DeclaredDevice("operator", operator.driver == "simulated", operator.driver))
    site = _certificate(file.rest.site.certificate)
    return (*devices, DeclaredDevice("site", False, certificate=site)) if site is not None else tuple(devices)


def _certificate(given: Certificate | None) -> DeclaredCertificate | None:
    return None if given is None else DeclaredCertificate(given.number, given.laboratory, given.due.isoformat())
