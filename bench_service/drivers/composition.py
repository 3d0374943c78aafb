"""Choice of a bench's driver and devices by the settings: the one place, for service, supervisor and `bench stop`.

Light imports: simulators and drivers are loaded where they are used.
"""

from functools import lru_cache, partial
from pathlib import Path
from typing import TYPE_CHECKING

from bench_service.bench.devices import BenchDevices
from bench_service.bench.driver import BenchDriver
from bench_service.bench.prompts import Asking
from bench_service.drivers.device_register import DeviceRegister
from bench_service.drivers.registered import RegisteredDevices
from bench_service.model.errors import Misconfigured
from bench_service.settings import Settings

if TYPE_CHECKING:
    from bench_service.drivers.bench_file.document import BenchFile


def driver_of(settings: Settings, asking: Asking) -> BenchDriver:
    """Return the driver of the settings' bench: by its bench file, or simulated. Raises `Misconfigured`,
    `NotMounted`.
    """
    from bench_service.drivers.device_faults import FaultPlan
    from bench_service.drivers.simulated import SimulatedDriver

    register = DeviceRegister(settings.devices_in(), settings.bench_id)
    if settings.bench_file is None:
        faults = None if settings.device_faults is None else FaultPlan.parse(settings.device_faults)
        truths = settings.unit_truth, settings.bench_truth
        asked = asking if settings.ask_operator else None
        return SimulatedDriver(settings.bench_id, *truths, settings.real_time_factor, register, faults, asked)
    from bench_service.drivers.bench_file.document import read_bench_file
    from bench_service.drivers.wired.driver import BenchFileDriver

    file = read_bench_file(settings.bench_file)
    _require_id(file.id, settings)
    simulation = file.rest.simulation
    unit_truth, bench_truth = (
        None if truth is None else file.folder / truth for truth in (simulation.unit_truth, simulation.bench_truth)
    )
    bench_id = file.id if bench_truth is None else _id_in(bench_truth)
    return BenchFileDriver(file, SimulatedDriver(bench_id, unit_truth, bench_truth), register, asking)


def devices_of(folder: Path, bench_id: str, bench_file: Path | None = None) -> BenchDevices:
    """Return the devices of a bench on this host: real ones by the bench file given, or else by the one that the
    register in `folder` remembers; simulated ones where there is no bench file.

    The devices' state can be read whatever becomes of the bench file. The file is read when the devices are first
    commanded or compared, and kept: a change of the file holds from the process's next start.
    """
    register = DeviceRegister(folder, bench_id)
    file = _file_of(register, bench_file)
    if file is None:
        return RegisteredDevices(register)
    from bench_service.drivers.wired.devices import WiredDevices

    return WiredDevices(partial(_kept, file), register)


def _file_of(register: DeviceRegister, given: Path | None) -> Path | None:
    """The bench file of real devices: the given one, else the one that their register remembers; None: simulated."""
    if given is None:
        state = register.read()
        if state is None or not state.bench_file:
            return None
        given = Path(state.bench_file)
    return given.absolute()


@lru_cache(maxsize=16)
def _kept(path: Path) -> "BenchFile":
    """A bench file as this process read it first. One that cannot be read is tried again."""
    from bench_service.drivers.bench_file.document import read_bench_file

    return read_bench_file(path)


def own_devices(settings: Settings) -> BenchDevices:
    """Return the devices of the settings' own bench: real ones by its bench file, else simulated. Raises
    `Misconfigured` for a bench file that cannot be used, or that has another bench's id.
    """
    if settings.bench_file is not None:
        _require_id(_kept(settings.bench_file.absolute()).id, settings)
    return devices_of(settings.devices_in(), settings.bench_id, settings.bench_file)


def longest_safe_s(settings: Settings) -> float:
    """The longest time within which a device of the settings' bench is declared to be safe [s]; 0 on a simulated one.

    By the same bench file as `own_devices`. One that cannot be read any more counts as a table without a declaration:
    whoever waits too short would kill a worker in mid-braking.
    """
    file = _file_of(DeviceRegister(settings.devices_in(), settings.bench_id), settings.bench_file)
    if file is None:
        return 0.0
    from bench_service.drivers.interface.sections import Wire, WireTurntable

    try:
        devices = _kept(file).real().values()
    except Misconfigured:
        return float(WireTurntable.model_fields["safe_s"].default)
    return max((device.safe_s for device in devices if isinstance(device, Wire)), default=0.0)


def _require_id(found: str, settings: Settings) -> None:
    if found != settings.bench_id:
        raise Misconfigured(f"{settings.bench_file} is of bench {found!r}, and the settings of {settings.bench_id!r}")


def _id_in(truth: Path) -> str:
    """Id of the bench in a truth file: the simulated devices of any bench may be taken from it."""
    from bench_service.drivers.bench_file.reading import document_of, text_of

    described = document_of(truth, text_of(truth)).get("description", {})
    return str(described.get("id", ""))
