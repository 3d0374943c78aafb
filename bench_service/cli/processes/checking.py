"""The command ``bench check-file``: what a bench file says, and what its devices say to it. Moves nothing."""

from pathlib import Path

from rich.console import Console

from bench_service.drivers.bench_file.description import described
from bench_service.drivers.bench_file.document import BenchFile, read_bench_file
from bench_service.drivers.bench_file.unit_files import read_units
from bench_service.drivers.interface.sections import Wire
from bench_service.drivers.simulated import SimulatedDriver
from bench_service.drivers.wired.opening import Survey, survey
from bench_service.drivers.wired.parallel import named
from bench_service.wall_clock import now
from procedures.bench import BenchDescription

PASS, REFUSED = 0, 1


def check_bench_file(path: Path, connect: bool, console: Console) -> int:
    """Print the devices of a bench file and everything that would be refused; return the exit code. Raises
    `Misconfigured` for a file that cannot be read.
    """
    file = read_bench_file(path)
    units = read_units(file.folder / "units")
    found = survey(file) if connect else Survey()
    description = described(file, SimulatedDriver(file.id).description, found.found)
    console.print(f"bench {file.id}: {description.origin}", soft_wrap=True)
    for line in _devices(file, found, connect):
        console.print(line, soft_wrap=True)
    shown = ", ".join(unit.serial for unit in units) or f"none in {file.folder / 'units'}"
    console.print(f"units: {shown}", soft_wrap=True)
    for line in found.limit_differences(file):
        console.print(f"limit: {line}", soft_wrap=True)
    refused = _refusals(file, description, found, bool(units))
    for sentence in refused:
        console.print(f"refused: {sentence}", soft_wrap=True)
    if description.expired_certificates == "warn":
        for sentence in description.overdue(now().date().isoformat()):
            console.print(f"warning: {sentence}", soft_wrap=True)
    return REFUSED if refused else PASS


def _devices(file: BenchFile, found: Survey, connect: bool) -> list[str]:
    lines: list[str] = []
    for kind, section in file.devices.items():
        where = f" at {section.address}" if isinstance(section, Wire) else ""
        line = f"{named(kind)}: {section.driver}{where}"
        if kind in found.found:
            told = found.found[kind]
            status = "; ".join(map(str, told.status)) or "no status words"
            line += f": {told.identity}; {status}"
            line += f"; {found.readings[kind]}" if kind in found.readings else ""
        elif connect and isinstance(section, Wire):
            line += ": does not answer"
        lines.append(line)
    return lines


def _refusals(file: BenchFile, description: BenchDescription, found: Survey, units: bool) -> list[str]:
    """Everything that keeps jobs, or some of them, from running on the bench as it is; a sentence each."""
    sentences = [f"the {named(kind)}: {failure}" for kind, failure in found.failures.items()]
    if description.expired_certificates == "refuse":
        sentences += description.overdue(now().date().isoformat())
    if description.no_thermal_jobs:
        sentences.append(f"jobs that read temperatures: {description.no_thermal_jobs}")
    if not units and not file.within("unit_link"):
        sentences.append(f"every job: no unit is declared in {file.folder / 'units'}")
    return sentences
