"""Driver of a unit whose frames a file describes: implements `procedures.bench.imu.Imu`, over TCP, UDP or serial."""

from pathlib import Path

from bench_service.drivers.devices.unit_recordings import UnitRecordings, require_channels
from bench_service.drivers.interface.driver import DeviceDriver, DriverContext, Found
from bench_service.drivers.interface.sections import WireUnitLink
from bench_service.drivers.link.frame_stream import FrameStream
from bench_service.drivers.link.transport import Transport
from bench_service.drivers.protocols.frame_file import read_frame_file
from bench_service.drivers.protocols.framed import FramedDecoder
from bench_service.model.errors import Misconfigured
from procedures.bench.device import DeviceIdentity


class FramedSection(WireUnitLink):
    """Section of a framed unit link."""

    frame: Path
    """File that describes the frames; a relative one is sought next to the bench file."""


class FramedUnit(UnitRecordings):
    """Unit that is only listened to: it reports nothing of itself but its frames."""

    def __init__(self, section: FramedSection, context: DriverContext) -> None:
        """Read the frame's file. Raises `Misconfigured`."""
        path = context.folder / section.frame
        self._form = read_frame_file(path)
        unit = context.unit
        if unit is not None:
            require_channels(unit.channels, self._form.channels, lambda why: Misconfigured(f"{path}: {why}"))
            if unit.sample_rate_hz != self._form.rate_hz:
                raise Misconfigured(
                    f"{path}: rate_hz = {self._form.rate_hz:g}, and the unit is declared with {unit.sample_rate_hz:g}"
                )

        def opening(_line: Transport) -> FramedDecoder:
            return FramedDecoder(self._form)

        self._frames = FrameStream(section.address, opening, section.connect_s, context.note)
        super().__init__(self._frames, self._form.channels, self._form.rate_hz, section.answer_s, context)

    async def connect(self) -> Found:
        """Listen for the first frame; see `WireDevice`."""
        return await self.found(await self.identify())

    async def identify(self) -> DeviceIdentity:
        """Return the name of the frame's format as the model: the unit reports nothing else."""
        return DeviceIdentity(model=self._form.name)

    def close(self) -> None:
        """Stop listening; see `WireDevice`."""
        self._frames.close()


DRIVER = DeviceDriver("unit_link", "framed", FramedSection, FramedUnit)
