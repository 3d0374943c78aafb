"""Real devices without a job: made safe in parallel over wires of their own, read back, compared with their register.

Implements `bench_service.bench.devices.BenchDevices`. The register stays the record of what was commanded: a device
that is safe by it gets no command. Simulated devices of a mixed bench live in the driving process; of these it knows
only the register.
"""

from collections.abc import Callable, Coroutine, Mapping
from functools import partial
from typing import Any

from bench_service.bench.devices import AT_REST, DeviceState
from bench_service.drivers.bench_file.description import described
from bench_service.drivers.bench_file.document import BenchFile
from bench_service.drivers.device_register import DeviceLink, DeviceRegister
from bench_service.drivers.interface.driver import Kind
from bench_service.drivers.interface.sections import ChamberSection, DeviceSection, Wire
from bench_service.drivers.registered import SAFE as SAFE_STATE
from bench_service.drivers.wired.opening import SAFE, context_of, opened, survey
from bench_service.drivers.wired.parallel import in_parallel, named
from bench_service.drivers.wired.read_back import as_read, differences
from bench_service.model.errors import Misconfigured
from procedures.bench import SAFE_ORDER
from procedures.bench.errors import BenchError, DeviceBusy, DeviceFault


def unsafe_devices(state: DeviceState | None) -> frozenset[str]:
    """Return the names of the devices that the register has as unsafe; all where it knows nothing, or only that
    something failed. None: there is no register yet, and all are.
    """
    if state is None:
        return frozenset(SAFE_ORDER)
    conditions = {
        "turntable": state.table != AT_REST,
        "chamber": state.chamber_target_c not in (None, state.chamber_ambient_c),
        "current_source": state.current_ma != 0.0,
        "supply": state.powered,
    }
    found = frozenset(device for device, unsafe in conditions.items() if unsafe)
    return found or (frozenset(SAFE_ORDER) if state.fault else frozenset())


def safe_state(kind: str, section: DeviceSection | None, state: DeviceState) -> dict[str, Any]:
    """Return the fields of the register that change once a device was made safe, by the policy of its section.
    `section` None: the bench file has no such device.
    """
    if isinstance(section, ChamberSection) and section.on_safe != "ambient":
        return {"chamber_target_c": None}
    return SAFE_STATE[kind](state)


class WiredDevices:
    """The real devices of a bench file on this host, without a job. Implements
    `bench_service.bench.devices.BenchDevices`.
    """

    def __init__(self, read: Callable[[], BenchFile], register: DeviceRegister) -> None:
        """Set up; `read`: returns the bench file, or raises `Misconfigured`, when devices are first reached."""
        self._read = read
        self._register = register

    @property
    def _file(self) -> BenchFile:
        """The bench file. Raises `BenchError` where it cannot be used."""
        try:
            file = self._read()
        except Misconfigured as error:
            raise BenchError(f"the devices are real, and cannot be reached: {error}") from error
        if file.id != self._register.bench_id:
            raise BenchError(f"{file.path} is of bench {file.id!r}, and these devices of {self._register.bench_id!r}")
        return file

    def device_state(self) -> DeviceState | None:
        """Return the devices' last noted state from the register; asks no device. None: no process of this host ever
        had the link.
        """
        return self._register.read()

    def compare(self, by: str) -> tuple[str, ...]:
        """Read the real devices, and return a sentence for each difference from the register.

        Where there are differences the readings are written into the register. `by`: name of this process for the
        holder of the link. Nothing is compared, and the tuple is empty, where another process has the link or the
        register is new.
        """
        state, file = self._register.read(), self._file
        kinds: list[Kind] = [kind for kind in SAFE if kind in file.real()]
        if state is None or not kinds:
            return ()
        try:
            link = self._register.open(by, state.job)
        except DeviceBusy:
            return ()
        try:
            readings = survey(file, kinds).readings
            found = differences(link.state, readings, described(file, None))
            if found:
                link.note("bench.compared", {"differences": found}, **as_read(readings))
            return found
        finally:
            link.close()

    def make_safe(self, by: str) -> DeviceState:
        """Make every device safe that is not, at the same time; each is noted as soon as it reads back as safe.

        Raises `DeviceBusy`, and an `ExceptionGroup` of the failures, after the others are safe.
        """
        state = self._register.read()
        if state is not None and state.safe:
            return state
        file = self._file
        link = self._register.open(by, None if state is None else state.job)
        try:
            failures = self._make_safe(file, link, unsafe_devices(state))
            fault = "; ".join(map(str, failures))
            link.note(f"bench.make_safe.{'failed' if fault else 'done'}", {}, fault=fault)
            if failures:
                raise ExceptionGroup("the bench could not be made safe", failures)
            return link.state
        finally:
            link.close()

    def _make_safe(self, file: BenchFile, link: DeviceLink, unsafe: frozenset[str]) -> list[Exception]:
        """Make devices safe; simulated ones, of a process that is gone, are safe with it."""
        real = file.real()
        for device in SAFE_ORDER:
            if device in unsafe and device not in real:
                link.note(f"{device}.make_safe", {}, **SAFE_STATE[device](link.state))
        kinds: list[Kind] = [kind for kind in SAFE if kind in unsafe and kind in real]
        context = context_of(file)
        work: dict[Kind, Callable[[], Coroutine[Any, Any, None]]] = {
            kind: partial(_open_and_make_safe, partial(opened, file, (kind,), context), kind) for kind in kinds
        }
        failures: dict[Kind, Exception] = {}

        def done(kind: Kind, outcome: Exception | None) -> None:
            if outcome is None:
                link.note(f"{kind}.make_safe", {}, **safe_state(kind, real[kind], link.state))
            else:
                failures[kind] = outcome
                link.note(f"{kind}.make_safe.failed", {"error": f"{type(outcome).__name__}: {outcome}"})

        in_parallel(work, {kind: _deadline_s(real[kind]) for kind in kinds}, done)
        return [_of_device(kind, failures[kind]) for kind in kinds if kind in failures]


async def _open_and_make_safe(make: Callable[[], Mapping[Kind, Any]], kind: Kind) -> None:
    """Make a device by its driver and make it safe, in its own thread: what fails here is its own failure."""
    device = make()[kind]
    try:
        await device.connect()
        await device.make_safe()
    finally:
        device.close()


def _deadline_s(section: DeviceSection) -> float:
    assert isinstance(section, Wire)
    return section.safe_s


def _of_device(kind: Kind, failure: Exception) -> Exception:
    """A failure whose text names its device."""
    if named(kind) in str(failure):
        return failure
    shape = type(failure) if isinstance(failure, BenchError) else DeviceFault
    return shape(f"the {named(kind)}: {failure or type(failure).__name__}")
