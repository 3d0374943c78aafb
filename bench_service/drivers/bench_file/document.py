"""Model of a bench file, and its reading. Knows sections and drivers' names; makes no device."""

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any, Literal

from pydantic import Field

from bench_service.drivers.bench_file.reading import document_of, place, text_of, validated
from bench_service.drivers.interface.driver import KINDS, Kind
from bench_service.drivers.interface.registry import driver as registered
from bench_service.drivers.interface.sections import (
    SIMULATED,
    Certificate,
    ChamberSection,
    CurrentSourceSection,
    DeviceSection,
    EnvironmentSection,
    OperatorSection,
    Section,
    SupplySection,
    TurntableSection,
    UnitLinkSection,
    Wire,
)
from bench_service.model.errors import Misconfigured

BASES: dict[Kind, type[DeviceSection]] = {
    "turntable": TurntableSection,
    "chamber": ChamberSection,
    "supply": SupplySection,
    "unit_link": UnitLinkSection,
    "current_source": CurrentSourceSection,
    "environment": EnvironmentSection,
}
ENTERED = "entered"
"""Driver of an environment whose values are entered in the file."""
REQUIRED: tuple[Kind, ...] = ("turntable", "supply", "unit_link")
"""Devices that every bench has, real or simulated."""


class Identity(Section):
    """Table ``[bench]`` of a bench file: id and title."""

    id: str = Field(pattern=r"^[a-z0-9][a-z0-9_-]{0,31}$")
    title: str = ""


class SiteSection(Section):
    """Table ``[site]`` of a bench file: gravity, latitude, azimuth with uncertainties; see
    `procedures.core.site.Site`.
    """

    latitude_deg: Annotated[float, Field(ge=-90.0, le=90.0)]
    gravity_m_s2: Annotated[float, Field(ge=9.7, le=9.9)]
    gravity_sd_m_s2: Annotated[float, Field(ge=0.0, le=0.01)] = 0.0
    azimuth_deg: Annotated[float, Field(ge=-360.0, le=360.0)] = 0.0
    azimuth_sd_arcsec: Annotated[float, Field(ge=0.0, le=3600.0)] = 0.0
    latitude_sd_arcsec: Annotated[float, Field(ge=0.0, le=3600.0)] = 0.0
    certificate: Certificate | None = None


class Policy(Section):
    """Table ``[policy]`` of a bench file: what an expired certificate leads to."""

    expired_certificate: Literal["refuse", "warn"] = "refuse"


class Simulation(Section):
    """Table ``[simulation]``: truths of the devices that are simulated; without it, those that ship."""

    unit_truth: Path | None = None
    bench_truth: Path | None = None
    seed: Annotated[int, Field(ge=0, le=2**63 - 1)] = 1
    time_factor: Annotated[float, Field(gt=0.0, le=10_000.0)] = 1.0
    """Bench seconds per real second of served simulators behind the addresses; 1 with any real device.

    Other than 1, every device counts as simulated.
    """


class Rest(Section):
    """The tables of a bench file that are not devices with a driver."""

    bench: Identity
    site: SiteSection
    operator: OperatorSection = OperatorSection()
    policy: Policy = Policy()
    simulation: Simulation = Simulation()


@dataclass(frozen=True)
class BenchFile:
    """A bench file, read and checked: the sections of its devices, and its other tables."""

    path: Path
    rest: Rest
    devices: dict[Kind, DeviceSection]
    """Section of each device that the bench has; those of real drivers with the drivers' own fields."""

    @property
    def id(self) -> str:
        """Id of the bench, by which the database knows it."""
        return self.rest.bench.id

    @property
    def folder(self) -> Path:
        """Folder of the file, to which the file's own names refer."""
        return self.path.parent

    def real(self) -> dict[Kind, DeviceSection]:
        """Return the sections of the devices that are real or behind an address, by kind."""
        return {kind: section for kind, section in self.devices.items() if isinstance(section, Wire)}

    @property
    def time_factor(self) -> float:
        """Number of bench seconds per real second; not 1 only where served simulators run faster."""
        return self.rest.simulation.time_factor

    def within(self, kind: Kind) -> bool:
        """Return whether the bench has this device, and it is simulated within the driving process."""
        section = self.devices.get(kind)
        return section is not None and section.driver == SIMULATED

    def simulated(self, kind: Kind) -> bool:
        """Return whether the bench has this device, and it is simulated, in this process or behind its address."""
        return self.within(kind) or (kind in self.devices and self.time_factor != 1.0)


def read_bench_file(path: Path) -> BenchFile:
    """Read and check a bench file, and return it. Raises `Misconfigured` naming line and field, also for a driver that
    does not exist.
    """
    text = text_of(path)
    given = document_of(path, text)
    tables: dict[str, Any] = {name: value for name, value in given.items() if name not in KINDS}
    rest = validated(Rest, tables, path, text)
    found: dict[Kind, DeviceSection] = {kind: BASES[kind]() for kind in REQUIRED}
    for kind in KINDS:
        if kind in given:
            found[kind] = _section(kind, given[kind], path, text)
    file = BenchFile(path, rest, found)
    if file.time_factor != 1.0 and (mine := next((kind for kind in found if file.within(kind)), None)) is not None:
        at = place(path, text, ("simulation", "time_factor"))
        raise Misconfigured(
            f"{at}: simulation.time_factor = {file.time_factor:g}: the {mine} is simulated in the driving process, "
            "which keeps real time"
        )
    if rest.operator.driver not in (SIMULATED, "asked"):
        at = place(path, text, ("operator", "driver"))
        raise Misconfigured(f'{at}: operator.driver = {rest.operator.driver!r} must be "asked" or "simulated"')
    if rest.operator.address is not None and rest.operator.address.scheme != "tcp":
        at = place(path, text, ("operator", "address"))
        raise Misconfigured(f"{at}: operator.address = {rest.operator.address}: a served person listens on tcp")
    return file


def _section(kind: Kind, given: Any, path: Path, text: str) -> DeviceSection:
    base = BASES[kind]
    name = given.get("driver", base.model_fields["driver"].default) if isinstance(given, dict) else None
    plain = ENTERED if kind == "environment" else SIMULATED
    if not isinstance(name, str) or name == plain:
        return validated(base, given, path, text, (kind,))
    if name == SIMULATED:
        raise Misconfigured(f'{place(path, text, (kind, "driver"))}: {kind}.driver = "simulated": give "entered"')
    try:
        driver = registered(kind, name)
    except Misconfigured as error:
        raise Misconfigured(f"{place(path, text, (kind, 'driver'))}: {kind}.{error}") from error
    return validated(driver.section, given, path, text, (kind,))
