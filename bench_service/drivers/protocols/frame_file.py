"""Description of a unit's frames by a file: sync, length, counter, channels, status, checksum."""

import tomllib
from math import isfinite
from pathlib import Path
from typing import Annotated, Literal

from pydantic import BaseModel, ConfigDict, Field, ValidationError, model_validator

from bench_service.drivers.protocols.checksums import CHECKSUMS
from bench_service.model.errors import Misconfigured
from procedures.core.recording import Channel, Quantity

SIZES = {"u8": 1, "i8": 1, "u16": 2, "i16": 2, "i24": 3, "u32": 4, "i32": 4}
LONGEST_FRAME = 1024
Type = Literal["u8", "i8", "u16", "i16", "i24", "u32", "i32"]
Text = Annotated[str, Field(min_length=1, max_length=64)]


class _Part(BaseModel):
    model_config = ConfigDict(extra="forbid", frozen=True)


class CounterPart(_Part):
    """Counter in each frame: its place and type, its step, and where it begins again."""

    offset: int = Field(ge=0)
    type: Literal["u8", "u16", "u32"]
    bits: int | None = Field(default=None, ge=1, le=32)
    """Number of its lowest bits that count; none: all."""
    step: int = Field(default=1, ge=1, le=65536)
    begins_again_at: int | None = Field(default=None, ge=2, le=2**32)
    """Number after which it begins again where that is no power of two, as of milliseconds of a week."""

    @property
    def modulus(self) -> int:
        """Number of values of the counter, after which it begins again at 0."""
        if self.begins_again_at is not None:
            return self.begins_again_at
        return 1 << (8 * SIZES[self.type] if self.bits is None else self.bits)


class ChannelPart(_Part):
    """Channel of the unit in each frame: its name and unit, its place, type, scale and offset."""

    name: Text
    quantity: Quantity
    unit: Text
    offset: int = Field(ge=0)
    type: Literal["i8", "u8", "i16", "u16", "i24", "i32"]
    scale: float
    zero: float = 0.0
    """Raw count at zero."""

    @property
    def channel(self) -> Channel:
        """The channel as recordings have it. Raises `ValueError`."""
        return Channel(self.name, self.quantity, self.unit, self.scale, self.zero)


class StatusPart(_Part):
    """Status word, with the polarity of its bits."""

    name: Text
    offset: int = Field(ge=0)
    type: Literal["u8", "u16", "u32"]
    failed_when: Literal[0, 1] = 1
    """Value of a bit that means failed, or not valid."""
    invalid_mask: int = Field(default=0, ge=0, le=0xFFFFFFFF)
    """Bits of which any one, at `failed_when`, means that the data are not valid."""
    bits: dict[str, Text] = {}
    """Number of a bit -> its name."""


class ChecksumPart(_Part):
    """Checksum in each frame: its kind, its place, and the bytes that it covers."""

    kind: Literal["crc16-xmodem", "crc16-ccitt-false", "crc32-mpeg2", "crc32-ieee", "crc32-novatel", "sum16-words"]
    offset: int = Field(ge=0)
    start: int = Field(default=0, ge=0)
    pad_to: int = Field(default=1, ge=1, le=8)
    """The covered bytes are filled with zeros to a multiple of this."""


class FrameFormat(_Part):
    """Format of a unit's frames, all of one length: sync, counter, channels, status, checksum."""

    name: Text
    sync: str = Field(pattern=r"^[0-9A-Fa-f]{2}( ?[0-9A-Fa-f]{2}){0,7}$")
    length: int = Field(ge=4, le=LONGEST_FRAME)
    byte_order: Literal["little", "big"]
    rate_hz: float = Field(gt=0.0, le=100_000.0)
    counter: CounterPart
    channel: tuple[ChannelPart, ...] = Field(min_length=1, max_length=64)
    status: tuple[StatusPart, ...] = Field(default=(), max_length=8)
    checksum: ChecksumPart

    @property
    def sync_bytes(self) -> bytes:
        """Bytes with which a frame begins."""
        return bytes.fromhex(self.sync)

    @property
    def channels(self) -> tuple[Channel, ...]:
        """Channels of the frame as recordings have them, in the order of the file."""
        return tuple(part.channel for part in self.channel)

    @model_validator(mode="after")
    def _fits(self) -> "FrameFormat":
        parts = [("counter", self.counter.offset, self.counter.type)]
        parts += [(f"channel {part.name}", part.offset, part.type) for part in self.channel]
        parts += [(f"status {part.name}", part.offset, part.type) for part in self.status]
        for name, offset, kind in parts:
            if offset + SIZES[kind] > self.length:
                raise ValueError(f"{name} at offset {offset} ends beyond the frame's length of {self.length}")
        size = CHECKSUMS[self.checksum.kind][0]
        if self.checksum.offset + size > self.length or self.checksum.start >= self.checksum.offset:
            raise ValueError(f"checksum at offset {self.checksum.offset} covers nothing or ends beyond the frame")
        if self.counter.bits is not None and self.counter.bits > 8 * SIZES[self.counter.type]:
            raise ValueError(f"counter.bits = {self.counter.bits} is more than {self.counter.type} has")
        names = [part.name for part in self.channel]
        if len(set(names)) != len(names):
            raise ValueError("two channels have the same name")
        for part in self.channel:
            if not isfinite(part.scale) or part.scale == 0.0:
                raise ValueError(f"channel {part.name}: scale = {part.scale!r} must be finite and not zero")
            _ = part.channel
        for word in self.status:
            if any(not bit.isdigit() or int(bit) >= 8 * SIZES[word.type] for bit in word.bits):
                raise ValueError(f"status {word.name}: a bit of {sorted(word.bits)} is none of {word.type}")
        return self


def read_frame_file(path: Path) -> FrameFormat:
    """Read and check a file that describes frames, and return their format. Raises `Misconfigured` with file, field and
    what is allowed.
    """
    try:
        return FrameFormat.model_validate(tomllib.loads(path.read_text(encoding="utf-8")))
    except ValidationError as error:
        first = error.errors()[0]
        where = ".".join(str(part) for part in first["loc"]) or "frame"
        raise Misconfigured(f"{path}: {where}: {first['msg']}") from None
    except (OSError, ValueError) as error:
        raise Misconfigured(f"{path}: {error}") from None
