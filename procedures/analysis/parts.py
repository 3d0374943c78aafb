"""Parts of recordings: some of the channels, or a stretch of time."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Protocol, runtime_checkable

from procedures.core.errors import BadParameter
from procedures.core.recording import RawArray, Recording, RecordingInfo


@runtime_checkable
class ByChannel(Protocol):
    """A recording that can be read without some of its channels. Interface."""

    def only(self, names: Sequence[str]) -> Recording:
        """Return the recording of some channels, in that order. Raises `MissingChannel`."""
        ...


@dataclass(frozen=True)
class Picked:
    """Some channels of a recording that is read whole."""

    info: RecordingInfo
    whole: Recording
    columns: tuple[int, ...]

    @classmethod
    def of(cls, recording: Recording, names: Sequence[str]) -> "Picked":
        """Return the channels of these names, in that order. Raises `MissingChannel`."""
        return cls(recording.info.only(names), recording, tuple(recording.info.column(name) for name in names))

    def blocks(self) -> Iterator[RawArray]:
        for block in self.whole.blocks():
            yield block[:, self.columns]


def of_channels(recording: Recording, names: Sequence[str]) -> Recording:
    """Return the recording of some channels, in that order, whose samples alone are read where its storage can. Raises
    `MissingChannel`.
    """
    return recording.only(names) if isinstance(recording, ByChannel) else Picked.of(recording, names)


@dataclass(frozen=True)
class Stretch:
    """Recording of the samples `start` … `stop` (half open) of another recording."""

    info: RecordingInfo
    whole: Recording
    start: int
    stop: int

    def only(self, names: Sequence[str]) -> Recording:
        """Return the same stretch of some channels. Raises `MissingChannel`."""
        return Stretch(self.info.only(names), of_channels(self.whole, names), self.start, self.stop)

    def blocks(self) -> Iterator[RawArray]:
        seen = 0
        for block in self.whole.blocks():
            part = block[max(self.start - seen, 0) : max(self.stop - seen, 0)]
            seen += len(block)
            if len(part):
                yield part
            if seen >= self.stop:
                return


def cut(recording: Recording, start_s: float | None, stop_s: float | None) -> Recording:
    """Return the recording from one second of it to another; None: from its beginning, to its end. Its id and hash
    stay.

    Raises `BadParameter` where nothing lies between them, or where the recording is shorter.
    """
    info = recording.info
    if start_s is None and stop_s is None:
        return recording
    allowed = f"within 0 … {info.duration_s:g} s, the length of recording {info.id}"
    for name, value in (("start_s", start_s), ("stop_s", stop_s)):
        if value is not None and not 0.0 <= value <= info.duration_s * (1.0 + 1e-9):
            raise BadParameter(name, value, allowed)
    start = round((start_s or 0.0) * info.rate_hz)
    stop = info.count if stop_s is None else min(round(stop_s * info.rate_hz), info.count)
    if stop <= start:
        raise BadParameter("stop_s", stop_s, f"later than start_s, {start_s or 0.0:g} s, {allowed}")
    told = replace(info, count=stop - start, start_s=info.start_s + start / info.rate_hz)
    return Stretch(told, recording, start, stop)
