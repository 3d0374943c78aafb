"""A launch at rest from raw counts to noise coefficients: two passes over its blocks, in bounded memory.

The first pass inspects the samples and gathers cell means, which determine what is trimmed and removed. The second pass
computes everything faster than a cell from every sample after the trim; everything slower comes from the cells.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np

from procedures.analysis.allan.correlated import Uncorrelatable
from procedures.analysis.allan.deviation import Deviation, DeviationStream
from procedures.analysis.allan.statistic import Sizes, decade_sizes
from procedures.analysis.cells import Cells, CellStream, cell_samples, channel_rows
from procedures.analysis.fitness.findings import FitnessSettings
from procedures.analysis.fitness.watched import Inspection, Seen, Watched, each_watched
from procedures.analysis.launch.channel import channel_noise
from procedures.analysis.launch.context import ChannelContext, smooth_temperatures, temperature_names
from procedures.analysis.launch.resolution import Coarse, Resolution
from procedures.analysis.launch.results import ChannelNoise, LaunchNoise
from procedures.analysis.launch.settings import LaunchSettings
from procedures.analysis.launch.signal import CleanSignal, clean_signal
from procedures.analysis.noise_fit.powers import FastPowers, Powers
from procedures.analysis.parts import of_channels
from procedures.core import spread
from procedures.core.arrays import Array
from procedures.core.errors import UnfitRecording
from procedures.core.recording import AROUND, RawArray, Recording, RecordingInfo

INSPECTION = Inspection(FitnessSettings())
"""Inspection settings of a launch: the unit is at rest throughout."""
FEWEST_CELLS = 120
"""Fewest cells of a launch that can be analysed."""
CROSSOVER = 0.03
"""Share of the cell frequency above which the spectrum is taken from every sample; below it from the cells, whose means
alias the reading noise of all higher frequencies."""
SLOW_MODES = 64
"""Fewest modes of the spectrum that are taken from the cells."""
LONG, AT_ONCE = 20_000_000, 2
"""A recording of more than `LONG` samples is analysed `AT_ONCE` channels at a time: less memory, more reading."""
FEWEST_A_CELL = 8
"""Fewest samples a cell for which the full rate is analysed; with fewer it adds no information."""


def analyse_launch(recording: Recording, label: str, settings: LaunchSettings) -> LaunchNoise:
    """Return the noise of all channels but temperatures of one launch. Raises `UnfitRecording` (recording, channel,
    value) and `BadParameter`.
    """
    return analyse_launches([recording], [label], settings)[0]


def analyse_launches(
    recordings: Sequence[Recording], labels: Sequence[str], settings: LaunchSettings
) -> tuple[LaunchNoise, ...]:
    """Return the noise of each recording as `analyse_launch` does; launches and channels are parts that `spread` may
    compute at one time.
    """
    names = [_names(recording.info) for recording in recordings]
    if len(recordings) == 1 and spread.width() > 1:
        firsts = [_first_in_two(recordings[0], names[0], settings)]
    else:
        firsts = each_watched(_first_pass, recordings, lambda i, recording: (recording, names[i], settings))
    # As many parts of a launch as make all processes busy; the channels of one part share a reading.
    parts = 1 if len(recordings) % spread.width() == 0 else spread.width()
    tasks = [
        (recording, some, first.only(some), settings)
        for recording, channels, first in zip(recordings, names, firsts, strict=True)
        for some in _groups(channels, recording.info.count, parts)
    ]
    results = iter(spread.each(_channels, tasks))
    found: list[LaunchNoise] = []
    for recording, label, channels in zip(recordings, labels, names, strict=True):
        info = recording.info
        groups = _groups(channels, info.count, parts)
        noises = tuple(noise for _ in groups for noise in next(results))
        found.append(LaunchNoise(info.id, label, info.rate_hz, info.duration_s, info.since_launch_s, noises))
    return tuple(found)


def _names(info: RecordingInfo) -> tuple[str, ...]:
    names = tuple(c.name for c in info.channels if c.quantity not in AROUND)
    if not names:
        raise UnfitRecording(f"recording {info.id} has no channel whose noise could be analysed")
    return names


def _groups(names: tuple[str, ...], count: int, parts: int) -> list[tuple[str, ...]]:
    size = max(1, min(-(-len(names) // parts), len(names) if count <= LONG else AT_ONCE))
    return [names[i : i + size] for i in range(0, len(names), size)]


@dataclass(frozen=True)
class _First:
    """Cell means of the first pass, and the context of each channel."""

    cells: Cells
    known: dict[str, ChannelContext]

    def only(self, names: Sequence[str]) -> "_First":
        """The same of some of the channels."""
        rows = self.cells.rates[[self.cells.channels.index(name) for name in names]]
        return _First(replace(self.cells, channels=tuple(names), rates=rows), {n: self.known[n] for n in names})


def _first_pass(task: tuple[Recording, tuple[str, ...], LaunchSettings]) -> _First:
    """Gather the cells while the recording is inspected. Raises `UnfitRecording`."""
    recording, names, settings = task
    watched = recording if isinstance(recording, Watched) else Watched(recording, INSPECTION)
    gathered = _gathered((watched, names, settings))
    return _known(watched, gathered, names)


def _first_in_two(recording: Recording, names: tuple[str, ...], settings: LaunchSettings) -> _First:
    """Gather the cells of a lone recording beside its inspection. Raises `UnfitRecording`."""
    watched = recording if isinstance(recording, Watched) else Watched(recording, INSPECTION)
    if watched.is_read:
        return _first_pass((watched, names, settings))
    gathered, seen = spread.each(_either, [(True, watched, names, settings), (False, watched, names, settings)])
    assert isinstance(gathered, _Gathered)
    assert isinstance(seen, tuple)
    watched.learn(seen)
    watched.require_fit()
    return _known(watched, gathered, names)


def _either(task: tuple[bool, Watched, tuple[str, ...], LaunchSettings]) -> "_Gathered | Seen":
    cells, watched, names, settings = task
    return _gathered((watched.unwatched, names, settings)) if cells else watched.seen()


@dataclass(frozen=True)
class _Gathered:
    cells: Cells
    coarse: dict[str, Coarse]


def _gathered(task: tuple[Recording, tuple[str, ...], LaunchSettings]) -> _Gathered:
    """Gather cell means, also of temperatures, and each channel's resolution. Raises `UnfitRecording`."""
    recording, names, settings = task
    info = recording.info
    columns = [info.column(name) for name in names]
    resolution = Resolution([info.channels[c] for c in columns], info.rate_hz)
    everything = (*names, *temperature_names(info))
    stream = CellStream(info, everything, settings.cell_s)

    def seen() -> Iterator[RawArray]:
        for block in recording.blocks():
            resolution.add(block, columns)
            yield block

    for rows in channel_rows(info, everything, seen()):
        stream.add(rows)
    return _Gathered(stream.finish(), resolution.finish())


def _known(watched: Watched, gathered: _Gathered, names: tuple[str, ...]) -> _First:
    """The context of each channel. Raises `UnfitRecording`."""
    found, cells = watched.fitness(), gathered.cells
    if cells.rates.shape[1] < FEWEST_CELLS:
        raise UnfitRecording(
            f"recording {watched.info.id}: {cells.rates.shape[1]} cells of {cells.cell_s:g} s are too few for a noise "
            f"analysis, at least {FEWEST_CELLS} are needed{_shorter_cells(cells, watched.info.rate_hz)}"
        )
    warm = smooth_temperatures(cells, temperature_names(watched.info))
    sentences = {f.channel: tuple(finding.sentence for finding in f.findings) for f in found}
    coarse = gathered.coarse
    return _First(cells, {n: ChannelContext(sentences.get(n, ()), coarse.get(n), warm) for n in names})


def _shorter_cells(cells: Cells, rate_hz: float) -> str:
    """The way out for a record that is too short: a longer one, or cells of one leading digit that give enough."""
    longer = f": record at least {FEWEST_CELLS * cells.cell_s:g} s"
    longest = (cells.rates.shape[1] - 1) * cells.cell_s / FEWEST_CELLS
    if longest * rate_hz < FEWEST_A_CELL:
        return longer
    digit = 10.0 ** np.floor(np.log10(longest))
    return f"{longer}, or make cell_s shorter, {np.floor(longest / digit) * digit:g} at the most"


def _channels(task: tuple[Recording, tuple[str, ...], _First, LaunchSettings]) -> list[ChannelNoise]:
    """Analyse some channels of a launch: the second pass, and the fits. Raises `UnfitRecording`."""
    recording, names, first, settings = task
    info, cells = recording.info, first.cells
    rows = dict(zip(cells.channels, cells.rates, strict=True))
    signals = [clean_signal(name, rows[name], cells.cell_s, cells.since_launch_s, settings) for name in names]
    parts: list[tuple[Deviation | None, Powers | None]] = [(None, None)] * len(names)
    if settings.fast and cell_samples(info.rate_hz, settings.cell_s) >= FEWEST_A_CELL:
        parts = _second_pass(recording, names, signals, settings)
    return [
        channel_noise(
            name, info.channels[info.column(name)].rate_unit, cells, signal, *part, first.known[name], settings
        )
        for name, signal, part in zip(names, signals, parts, strict=True)
    ]


@dataclass
class _Streams:
    """The streams of one channel's fast part, fed after the trimmed samples have passed."""

    deviation: DeviationStream
    powers: FastPowers
    trimmed: int

    def add(self, row: Array) -> None:
        """Add the next samples, (n,) [rate]."""
        passed = min(self.trimmed, len(row))
        self.trimmed -= passed
        if passed < len(row):
            self.deviation.add(row[passed:])
            self.powers.add(row[passed:])


def _second_pass(
    recording: Recording, names: Sequence[str], signals: Sequence[CleanSignal], settings: LaunchSettings
) -> list[tuple[Deviation | None, Powers | None]]:
    """Compute deviations at short times and powers at high frequencies from every sample.

    A channel that cannot be correlated is read once more, and differenced term by term.
    """
    streams = _passed(recording, names, signals, settings, correlate=True)
    found: dict[str, tuple[Deviation | None, Powers | None]] = {}
    left: list[int] = []
    for i, (name, stream) in enumerate(zip(names, streams, strict=True)):
        try:
            found[name] = stream.deviation.finish(), stream.powers.finish()
        except Uncorrelatable:
            left.append(i)
    if left:
        again = [names[i] for i in left]
        streams = _passed(recording, again, [signals[i] for i in left], settings, correlate=False)
        found |= {n: (s.deviation.finish(), s.powers.finish()) for n, s in zip(again, streams, strict=True)}
    return [found[name] for name in names]


def _passed(
    recording: Recording,
    names: Sequence[str],
    signals: Sequence[CleanSignal],
    settings: LaunchSettings,
    *,
    correlate: bool,
) -> list[_Streams]:
    """The streams of some channels after all samples."""
    info = recording.info
    samples = cell_samples(info.rate_hz, settings.cell_s)
    crossover_hz = max(CROSSOVER * info.rate_hz / samples, SLOW_MODES * 0.5 / info.duration_s)
    sizes: Sizes = decade_sizes(samples, 1.0 / settings.points_per_decade)
    streams = [
        _Streams(
            DeviationStream(info.rate_hz, info.count - signal.first_cell * samples, sizes=sizes, correlate=correlate),
            FastPowers(info.rate_hz, crossover_hz),
            signal.first_cell * samples,
        )
        for signal in signals
    ]
    some = of_channels(recording, names)
    for rows in channel_rows(some.info, names, some.blocks()):
        for stream, row in zip(streams, rows, strict=True):
            stream.add(row)
    return streams
