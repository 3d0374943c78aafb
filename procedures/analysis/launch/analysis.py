"""A launch at rest from raw counts to noise coefficients: two passes over its blocks, in bounded memory.

The first pass inspects the samples and gathers cell means, which determine what is trimmed and removed. The second pass
computes everything faster than a cell from every sample after the trim; everything slower comes from the cells.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

from procedures.analysis.allan.correlated import Uncorrelatable
from procedures.analysis.allan.deviation import Deviation, DeviationStream
from procedures.analysis.allan.statistic import Sizes, decade_sizes
from procedures.analysis.cells import Cells, CellStream, cell_samples, channel_rows
from procedures.analysis.fitness.findings import FitnessSettings
from procedures.analysis.fitness.watched import Inspection, Watched
from procedures.analysis.launch.channel import channel_noise
from procedures.analysis.launch.context import ChannelContext, Resolution, smooth_temperatures, temperature_names
from procedures.analysis.launch.results import LaunchNoise
from procedures.analysis.launch.settings import LaunchSettings
from procedures.analysis.launch.signal import CleanSignal, clean_signal
from procedures.analysis.noise_fit.powers import FastPowers, Powers
from procedures.core.arrays import Array
from procedures.core.errors import UnfitRecording
from procedures.core.recording import Quantity, RawArray, Recording

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
    """Analyse all channels but temperatures. Raises `UnfitRecording` (recording, channel, value) and `BadParameter`."""
    info = recording.info
    names = tuple(c.name for c in info.channels if c.quantity is not Quantity.TEMPERATURE)
    if not names:
        raise UnfitRecording(f"recording {info.id} has no channel whose noise could be analysed")
    cells, known = _first_pass(recording, names, settings)
    rows = dict(zip(cells.channels, cells.rates, strict=True))
    signals = [clean_signal(name, rows[name], cells.cell_s, cells.since_launch_s, settings) for name in names]
    samples = cell_samples(info.rate_hz, settings.cell_s)
    parts: list[tuple[Deviation | None, Powers | None]] = [(None, None)] * len(names)
    if settings.fast and samples >= FEWEST_A_CELL:
        size = len(names) if info.count <= LONG else AT_ONCE
        parts = []
        for i in range(0, len(names), size):
            group = names[i : i + size], signals[i : i + size]
            try:
                parts += _second_pass(recording, *group, settings, correlate=True)
            except Uncorrelatable:
                parts += _second_pass(recording, *group, settings, correlate=False)
    channels = tuple(
        channel_noise(name, info.channels[info.column(name)].rate_unit, cells, signal, *part, known[name], settings)
        for name, signal, part in zip(names, signals, parts, strict=True)
    )
    return LaunchNoise(info.id, label, info.rate_hz, info.duration_s, info.since_launch_s, channels)


def _first_pass(
    recording: Recording, names: Sequence[str], settings: LaunchSettings
) -> tuple[Cells, dict[str, ChannelContext]]:
    """Gather cell means, also of temperatures, and the context of each channel. Raises `UnfitRecording`."""
    info = recording.info
    temperatures = temperature_names(info)
    columns = [info.column(name) for name in names]
    resolution = Resolution([info.channels[c] for c in columns])
    watched = recording if isinstance(recording, Watched) else Watched(recording, INSPECTION)
    stream = CellStream(info, (*names, *temperatures), settings.cell_s)

    def seen() -> Iterator[RawArray]:
        for block in watched.blocks():
            resolution.add(block, columns)
            yield block

    for rows in channel_rows(info, (*names, *temperatures), seen()):
        stream.add(rows)
    found = watched.fitness()
    cells = stream.finish()
    if cells.rates.shape[1] < FEWEST_CELLS:
        raise UnfitRecording(
            f"recording {info.id}: {cells.rates.shape[1]} cells of {cells.cell_s:g} s are too few for a noise "
            f"analysis, at least {FEWEST_CELLS} are needed"
        )
    coarse, warm = resolution.finish(), smooth_temperatures(cells, temperatures)
    sentences = {f.channel: tuple(finding.sentence for finding in f.findings) for f in found}
    return cells, {name: ChannelContext(sentences.get(name, ()), coarse.get(name, ""), warm) for name in names}


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
    recording: Recording,
    names: Sequence[str],
    signals: Sequence[CleanSignal],
    settings: LaunchSettings,
    *,
    correlate: bool,
) -> list[tuple[Deviation | None, Powers | None]]:
    """Compute deviations at short times and powers at high frequencies from every sample. Raises `Uncorrelatable`."""
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
    for rows in channel_rows(info, names, recording.blocks()):
        for stream, row in zip(streams, rows, strict=True):
            stream.add(row)
    return [(stream.deviation.finish(), stream.powers.finish()) for stream in streams]
