"""Driver of a unit that speaks iXCOM over TCP: implements `procedures.bench.imu.Imu`."""

from pydantic import Field

from bench_service import wall_clock
from bench_service.drivers.answers import BadAnswer, Refusal
from bench_service.drivers.devices.unit_recordings import UnitRecordings
from bench_service.drivers.interface.driver import DeviceDriver, DriverContext, Found
from bench_service.drivers.interface.sections import WireUnitLink
from bench_service.drivers.link.frame_stream import FrameStream
from bench_service.drivers.link.transport import Transport
from bench_service.drivers.protocols import ixcom
from bench_service.drivers.protocols.ixcom import Frame, LogCommand, Message, Parameter
from bench_service.drivers.protocols.ixcom_stream import IxcomDecoder
from bench_service.model.errors import Misconfigured
from procedures.bench.device import DeviceIdentity
from procedures.core.recording import INCREMENTS, TRIADS, Channel


class IxcomSection(WireUnitLink):
    """Section of an iXCOM unit link."""

    channel: int = Field(default=0, ge=0, le=31)
    """Logical channel that is opened; another master has another one."""


class IxcomUnit(UnitRecordings):
    """Unit over iXCOM whose rates are 32-bit floats; a recording holds counts of the declared scales."""

    def __init__(self, section: IxcomSection, context: DriverContext) -> None:
        """Set up. Raises `Misconfigured` where the declared unit cannot be an iXCOM one."""
        self._section = section
        unit = context.unit
        if unit is None:
            raise Misconfigured("driver = 'ixcom': the unit on the bench must be declared, for its scales")
        if section.address.scheme == "udp":
            raise Misconfigured(f"address {section.address}: iXCOM needs tcp or serial")
        self._channels = self._in_order(unit.channels)
        self._identity = DeviceIdentity()
        self._frames = FrameStream(section.address, self._opening, section.connect_s, context.note)
        super().__init__(self._frames, self._channels, unit.sample_rate_hz, section.answer_s, context)

    async def connect(self) -> Found:
        """Open the channel and listen for the first frame; see `WireDevice`."""
        found = await self.found(self._identity)
        return Found(self._identity, found.status)

    async def identify(self) -> DeviceIdentity:
        """Return maker, part, serial and firmware as read when the channel was opened. Waits for the first frame; a
        unit without power that never answered has an empty identity. Raises `Disconnected`.
        """
        await self.found(self._identity)
        return self._identity

    def close(self) -> None:
        """Stop listening; see `WireDevice`."""
        self._frames.close()

    def _in_order(self, channels: tuple[Channel, ...]) -> tuple[Channel, ...]:
        names = (*TRIADS["gyro"], *TRIADS["accelerometer"])
        by_name = {channel.name: channel for channel in channels}
        missing = [name for name in names if name not in by_name]
        if missing or len(channels) != len(names):
            raise Misconfigured(
                f"driver = 'ixcom': the unit must be declared with the channels {', '.join(names)} alone"
            )
        found = tuple(by_name[name] for name in names)
        for channel in found:
            if channel.rate_unit not in ("rad/s", "m/s^2") or channel.offset != 0.0:
                raise Misconfigured(
                    f"channel {channel.name}: iXCOM sends rad/s and m/s^2 without offset, not {channel}"
                )
        return found

    def _opening(self, line: Transport) -> IxcomDecoder:
        """Open the channel, ask who it is, have IMURAW sent at the declared rate."""
        rate = self.rate_hz
        scales = [c.scale * (rate if c.quantity in INCREMENTS else 1.0) for c in self._channels]
        talk = _Talk(line, self._section.answer_s)
        talk.command(ixcom.open_channel(talk.counter(), self._section.channel))
        texts = [
            ixcom.text_of(talk.parameter(number)) for number in (Parameter.PART, Parameter.SERIAL, Parameter.FIRMWARE)
        ]
        self._identity = DeviceIdentity("iMAR", *texts)
        timing = int.from_bytes(talk.parameter(Parameter.MAIN_TIMING)[:2], "little")
        prescaler = max(1, int.from_bytes(talk.parameter(Parameter.PRESCALER)[:2], "little"))
        divider = timing / prescaler / rate
        if divider < 1.0 or abs(divider - round(divider)) > 1e-9:
            raise Refusal(f"{rate:g} Hz is not an integer fraction of the unit's {timing / prescaler:g} Hz")
        talk.command(ixcom.log(talk.counter(), LogCommand.CLEAR_ALL, 3, 1))
        talk.command(ixcom.log(talk.counter(), LogCommand.ADD, Message.IMURAW, round(divider)))
        decoder = IxcomDecoder(scales)
        decoder.begin_with(talk.rest)
        return decoder


class _Talk:
    """Commands and their answers before the stream begins."""

    def __init__(self, line: Transport, answer_s: float) -> None:
        self._line, self._answer_s = line, answer_s
        self._sent = 0
        self.rest = b""
        """Bytes that came after the newest answer."""

    def counter(self) -> int:
        """Counter of the next frame that is sent."""
        self._sent += 1
        return self._sent - 1

    def command(self, data: bytes) -> None:
        """Send a command and wait for its response. Raises `Refusal`, `BadAnswer`, `LineCut`."""
        self._line.send(data)
        ixcom.response(self._next(Message.RESPONSE))

    def parameter(self, number: Parameter) -> bytes:
        """Ask for a parameter; its response comes first."""
        self.command(ixcom.request_parameter(self.counter(), number))
        return ixcom.parameter(self._next(Message.PARAMETER), number)

    def _next(self, message: Message) -> Frame:
        """Next frame of a kind; frames of others in between are left out."""
        until = wall_clock.monotonic_s() + self._answer_s
        while True:
            while (length := ixcom.frame_length(self.rest)) is not None and len(self.rest) >= length:
                found, self.rest = ixcom.frame(self.rest[:length]), self.rest[length:]
                if found.message == message:
                    return found
            left = until - wall_clock.monotonic_s()
            if left <= 0.0:
                raise BadAnswer(f"no {message.name.lower()} came within {self._answer_s:g} s")
            self.rest += self._line.receive(left)


DRIVER = DeviceDriver("unit_link", "ixcom", IxcomSection, IxcomUnit)
