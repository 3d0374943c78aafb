"""Power spectral densities of a recording's channels as they are: nothing trimmed or subtracted but lines."""

from collections.abc import Sequence

from procedures.analysis.cells import CellStream, cell_samples, channel_rows
from procedures.analysis.launch.density import Density, density_of
from procedures.analysis.noise_fit.powers import FEWEST_SAMPLES, FastPowers, slow_powers
from procedures.core.errors import UnfitRecording
from procedures.core.recording import Recording, require_finite

CELL_S = 1.0
FEWEST_A_CELL = 8
"""Fewest samples a cell for which faster frequencies are taken from every sample."""


def densities(recording: Recording, names: Sequence[str], confidence: float) -> list[Density | None]:
    """Return the densities of channels in one pass, None of a recording that is too short for one.

    Raises `MissingChannel`, `UnfitRecording` for samples that are not numbers.
    """
    info = recording.info
    samples = cell_samples(info.rate_hz, max(CELL_S, 1.0 / info.rate_hz))
    if info.count // samples < FEWEST_SAMPLES:
        return [None] * len(names)
    stream = CellStream(info, names, samples / info.rate_hz)
    fast = [FastPowers(info.rate_hz) for _ in names] if samples >= FEWEST_A_CELL else []
    for rows in channel_rows(info, names, recording.blocks()):
        require_finite(info, names, rows.T)
        stream.add(rows)
        for powers, row in zip(fast, rows, strict=bool(fast)):
            powers.add(row)
    cells = stream.finish()
    found: list[Density | None] = []
    for index, row in enumerate(cells.rates):
        try:
            slow = slow_powers(row, cells.cell_s)
            found.append(density_of(slow, fast[index].finish() if fast else None, confidence))
        except UnfitRecording:
            found.append(None)
    return found
