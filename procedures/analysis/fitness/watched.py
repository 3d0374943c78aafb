"""Recordings that are inspected while an analysis reads them: one pass serves both.

The first pass over a recording's blocks also serves the inspection; a refusal at its end stops the analysis before any
result. A few outliers can be mended for a second analysis.
"""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field, replace
from typing import TypeVar

from procedures.analysis.fitness.findings import ChannelFitness, FitnessSettings, Kind, Severity
from procedures.analysis.fitness.grouped import grouped
from procedures.analysis.fitness.mended import Mended, Outliers
from procedures.analysis.fitness.stream import FitnessStream
from procedures.analysis.parts import Picked, of_channels
from procedures.core import spread
from procedures.core.errors import UnfitRecording
from procedures.core.recording import Channel, Quantity, RawArray, Recording, RecordingInfo, Station

A = TypeVar("A")
R = TypeVar("R")

WRONG_TEMPERATURES = (Kind.WRAPPED, Kind.WRONG_UNIT, Kind.NOT_FINITE, Kind.MISREAD)


@dataclass(frozen=True)
class Inspection:
    """Settings for the inspection of an analysis's recordings: requirements, channels, temperatures."""

    settings: FitnessSettings = field(default_factory=FitnessSettings)
    channels: tuple[str, ...] | None = None
    """Channels whose findings matter to the analysis; None: all."""
    temperatures: bool = False
    """True if the analysis depends on temperatures; otherwise impossible ones only cause warnings."""
    misread_refused: bool = False
    """True if a thermometer with too many readings that are no temperatures is refused, whatever else it shows."""

    def matters(self, found: ChannelFitness, channel: Channel) -> ChannelFitness | None:
        """Return the findings of a channel as far as they matter to the analysis; None where the channel does not."""
        if channel.quantity in (Quantity.TABLE_ANGLE, Quantity.TIME):
            return None
        if channel.quantity is not Quantity.TEMPERATURE:
            return found if self.channels is None or channel.name in self.channels else None
        if self.temperatures:
            return found
        wrong = (
            f if self.misread_refused and f.kind is Kind.MISREAD else replace(f, severity=Severity.WARN)
            for f in found.findings
            if f.kind in WRONG_TEMPERATURES
        )
        return replace(found, findings=tuple(wrong))

    def of_station(self, station: Station | None) -> FitnessSettings:
        """Return the requirements on the recording of one station: rest is not required where the station turns, nor
        gravity where it feeds a current. None: the requirements as they are.
        """
        if station is None:
            return self.settings
        turns, fed = station.turn is not None or station.sinusoid is not None, station.current_ma is not None
        still, weighs = self.settings.at_rest and not turns, self.settings.reads_gravity and not fed
        return replace(self.settings, at_rest=still, reads_gravity=weighs)


class Watched:
    """A recording whose first whole pass is its inspection; see `procedures.core.recording.Recording`."""

    def __init__(self, recording: Recording, inspection: Inspection, watch: "Watch | None" = None) -> None:
        self._recording, self._inspection, self._watch = recording, inspection, watch
        self._fitness: tuple[ChannelFitness, ...] | None = None
        self._outliers: Outliers = {}
        self._mended = False

    @property
    def info(self) -> RecordingInfo:
        """Description of the underlying recording."""
        return self._recording.info

    @property
    def is_read(self) -> bool:
        """True once a whole pass has been made."""
        return self._fitness is not None

    def blocks(self) -> Iterator[RawArray]:
        """Yield the blocks; the end of the first pass raises `UnfitRecording` where the recording is refused."""
        if self._fitness is not None:
            yield from self._later().blocks()
            return
        stream = self._stream()
        for block in self._recording.blocks():
            stream.add(block)
            yield block
        self._end(stream)
        self.require_fit()

    def only(self, names: Sequence[str]) -> Recording:
        """Return some of the channels, in that order, for a later pass. Raises `MissingChannel`.

        Before the first pass, which is the inspection, all are read.
        """
        return of_channels(self._later(), names) if self._fitness is not None else Picked.of(self, names)

    @property
    def unwatched(self) -> Recording:
        """The underlying recording, for a pass that is no inspection."""
        return self._recording

    def seen(self) -> "Seen":
        """Return the findings of the first pass, to be carried to this recording's original by `learn`."""
        return self.fitness(), self._outliers

    def learn(self, seen: "Seen") -> None:
        """Take over the findings of the first pass of a copy of this recording."""
        self._fitness, self._outliers = seen

    def fitness(self) -> tuple[ChannelFitness, ...]:
        """Return the findings by channel; the recording is read for them unless an analysis has read it to the end."""
        if self._fitness is None:
            stream = self._stream()
            for block in self._recording.blocks():
                stream.add(block)
            self._end(stream)
        assert self._fitness is not None
        return self._fitness

    def require_fit(self) -> None:
        """Raise `UnfitRecording`, with the refusals of all recordings of the analysis, where this one is refused."""
        if self.refused:
            (self._watch or Watch.of(self)).refuse()

    @property
    def refused(self) -> bool:
        """True if a finding forbids the analysis."""
        return any(f.refused for f in self.fitness())

    @property
    def has_outliers(self) -> bool:
        """True if the first whole pass found outliers to mend. False before that pass, which this does not make, and
        where the settings do not mend outliers.
        """
        return bool(self._outliers)

    def mend(self) -> None:
        """Replace each outlier in later passes by the mean of its two neighbours, a misread temperature by a straight
        line.
        """
        self._mended = True

    def _later(self) -> Recording:
        """The recording as passes after the first see it."""
        return Mended(self._recording, self._outliers) if self._mended else self._recording

    def _stream(self) -> FitnessStream:
        info = self.info
        settings = self._inspection.of_station(info.station)
        return FitnessStream(info.channels, info.rate_hz, info.count, settings)

    def _end(self, stream: FitnessStream) -> None:
        pairs = zip(stream.finish(), self.info.channels, strict=True)
        found = (self._inspection.matters(fitness, channel) for fitness, channel in pairs)
        self._fitness = tuple(f for f in found if f is not None)
        if self._inspection.settings.mends_outliers:
            self._outliers = {**stream.outliers(), **stream.misread()}


Seen = tuple[tuple[ChannelFitness, ...], Outliers]
"""Findings and outliers of a recording's first pass."""


def each_watched(
    work: Callable[[A], R], recordings: Sequence[Recording], item: Callable[[int, Recording], A]
) -> list[R]:
    """The results of `work` on ``item(i, recording)`` of each recording, which it reads to the end; see `spread.each`.

    The inspection that comes with the reading is known here afterwards, wherever it was made.
    """
    found = spread.each(_watched, [(work, item(i, recording), recording) for i, recording in enumerate(recordings)])
    for recording, (_, seen) in zip(recordings, found, strict=True):
        if seen is not None and isinstance(recording, Watched):
            recording.learn(seen)
    return [result for result, _ in found]


def _watched(task: tuple[Callable[[A], R], A, Recording]) -> tuple[R, Seen | None]:
    work, item, recording = task
    result = work(item)
    return result, recording.seen() if isinstance(recording, Watched) and recording.is_read else None


class Watch:
    """The recordings of one analysis, with their merged findings."""

    def __init__(self, recordings: Sequence[Recording], inspection: Inspection) -> None:
        self.recordings = tuple(Watched(r, inspection, self) for r in recordings)

    @classmethod
    def of(cls, watched: Watched) -> "Watch":
        """Return a watch over a single recording that is already a `Watched`."""
        watch = cls((), Inspection())
        watch.recordings = (watched,)
        return watch

    def refuse(self, but: Kind | None = None) -> None:
        """Raise `UnfitRecording` with all refusals of all recordings, if any, except those of kind `but`."""
        sentences = self._told(Severity.REFUSE, self.recordings, but)
        if not sentences:
            return
        alone = f"recording {self.recordings[0].info.id}: " if len(self.recordings) == 1 else ""
        raise UnfitRecording(alone + "; ".join(sentences))

    def warnings(self) -> tuple[str, ...]:
        """Return warnings on the recordings that were read; a recording that the analysis did not read does not
        count.
        """
        return self._told(Severity.WARN, [r for r in self.recordings if r.is_read])

    def mend(self) -> bool:
        """Mend the outliers of the recordings that were read; return whether there are any."""
        found = [r for r in self.recordings if r.is_read and r.has_outliers]
        for recording in found:
            recording.mend()
        return bool(found)

    def _told(self, severity: Severity, recordings: Sequence[Watched], but: Kind | None = None) -> tuple[str, ...]:
        return grouped([(_label(r.info), r.fitness()) for r in recordings], severity, but)


def _label(info: RecordingInfo) -> str:
    return f"station {info.station.label}" if info.station else f"recording {info.id}"
