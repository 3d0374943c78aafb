"""Noise of one triad, a function of (seed, launch, triad, channel, process, block): streamed, resumable, bounded.

Time is counted in ticks (sample intervals) since power-up. White noise is drawn in canonical blocks of 10 s. The slow
processes (bias instability, rate random walk, ramp, start-up, self-heating) are made as averages over *cells* of half
a second, exactly those of the continuous process, held through the cell; their canonical block is 1000 cells, and
what is carried from one to the next is the state at its start. The residue of the mechanical dither is a function of
the tick: a sinusoid of the integrated output, as it stands at the ticks.

Bias instability is a bank of M Gauss-Markov processes, two a decade, relaxation times at the middles of M equal
log-intervals of the flicker band, each of variance ``(B²/π)·ln(τ₂/τ₁)/M`` and started stationary
(`procedures.core.noise` defines the process). With ``h = (τ/Δ)·tanh(Δ/2τ)`` the mean over a cell from x₀ to x₁ is
``h·(x₀+x₁)`` plus an independent normal residue; for the rate random walk ``h = ½`` and the residue's variance is
``K²Δ/12``. The residues of all processes of a channel are one draw.
"""

from dataclasses import dataclass
from functools import cached_property
from math import ceil, cos, expm1, fmod, log, log10, pi, sin, sqrt
from typing import Any

import numpy as np

from procedures.importing import IMPORTING
from simulators.imu.blocks import Blocks
from simulators.truth import Array, KeyedBlocks, TriadTruth, keyed_generator

CELL_S = 0.5
CELLS_PER_WHITE_BLOCK = 20
CELLS_PER_SLOW_BLOCK = 1000
MEMBERS_PER_DECADE = 2


@dataclass(frozen=True)
class GaussMarkovBank:
    """Unit-variance Gauss-Markov members: relaxation times `times_s` (M,), `decay` over a cell, weights of its mean."""

    times_s: Array
    decay: Array
    weight: Array
    residue_variance: Array

    @classmethod
    def over(cls, band_s: tuple[float, float], cell_s: float) -> "GaussMarkovBank":
        """The bank for a flicker band [s] at a cell length [s]."""
        members = max(1, ceil(MEMBERS_PER_DECADE * log10(band_s[1] / band_s[0])))
        edges = np.linspace(log(band_s[0]), log(band_s[1]), members + 1)
        times = np.exp(0.5 * (edges[:-1] + edges[1:]))
        return cls(times, *cell_mean(cell_s / times))


def cell_mean(ratio: Array) -> tuple[Array, Array, Array]:
    """``e^{−r}``, h and the residue's variance of a unit Gauss-Markov process at r = Δ/τ.

    Variance of the mean ``2(r − 1 + e^{−r})/r²`` less the ends' part of it, ``2h²(1 + e^{−r})``; r/6 for small r.
    """
    decay = np.exp(-ratio)
    weight = np.tanh(0.5 * ratio) / ratio
    whole = 2.0 * (ratio + np.expm1(-ratio)) / ratio**2
    exact = whole - 2.0 * weight**2 * (1.0 + decay)
    return decay, weight, np.where(ratio < 1e-3, ratio / 6.0, exact)


@dataclass
class SlowState:
    """State at the start of a slow block: bank (M, 3) of unit variance, random walk (3,) [rate]."""

    block: int
    bank: Array
    walk: Array


class TriadNoise:
    """Noise of one triad during one launch. Time goes forward only."""

    def __init__(self, truth: TriadTruth, rate_hz: float, key: tuple[int, int, str]) -> None:
        """Set up a triad's noise. `key`: seed, launch number, triad's name."""
        self.rate_hz = rate_hz
        self.cell_ticks = max(1, ceil(CELL_S * rate_hz))
        self.cell_s = self.cell_ticks / rate_hz
        self._truth = truth
        self._seed, self._labels = key[0], key[1:]
        self._bank = GaussMarkovBank.over(truth.flicker_band_s, self.cell_s)
        self._blocks = Blocks(self.cell_ticks * CELLS_PER_WHITE_BLOCK, np.float64, self._fill_block)
        self._streams: dict[tuple[int, str], KeyedBlocks] = {}
        self._draw = np.empty(self._blocks.ticks)
        self._residue = DitherResidue(truth, rate_hz, self._blocks.ticks, key)
        self._slow_block = -1
        self._slow: Array = np.empty((3, 0))
        self._next = self._first_state()
        self._start = self._next

    @property
    def block_ticks(self) -> int:
        """Number of ticks of a canonical block."""
        return self._blocks.ticks

    def add_increments(self, total: Array, tick: int) -> None:
        """Add the noise of the integrated output in each of the ticks from `tick` on to `total`, (3, n) [rate·s]."""
        self._blocks.add_to(total, tick)

    def increments(self, tick: int, ticks: int) -> Array:
        """Return the noise alone, shape (3, ticks) [rate·s]."""
        total = np.zeros((3, ticks))
        self.add_increments(total, tick)
        return total

    def slow_integral(self, ticks: Array) -> Array:
        """Integral of the slow processes from power-up to each of some (real) ticks, shape (3, n) [rate·s].

        The same draws as in `increments`. Begins at power-up: one call, on a noise that was not used yet.
        """
        cells = int(np.max(ticks)) // self.cell_ticks + 1
        blocks = [self._slow_rates(b) for b in range(ceil(cells / CELLS_PER_SLOW_BLOCK))]
        rates = np.concatenate(blocks, axis=1)
        total = np.concatenate([np.zeros((3, 1)), np.cumsum(rates, axis=1)], axis=1) * self.cell_s
        knots = np.arange(total.shape[1]) * float(self.cell_ticks)
        return np.array([np.interp(ticks, knots, row) for row in total])

    def residue_angle(self, ticks: Array) -> Array:
        """Residue of the dither at the end of each of some ticks, counted from power-up, shape (3, n) [rate·s]."""
        return self._residue.angle(ticks)

    def white_integral(self, seconds: Array, purpose: str) -> Array:
        """Random walk over separate stretches, each one normal draw of variance ``N²·seconds``, (3, n) [rate·s]."""
        sd = np.array(self._truth.random_walk)[:, None] * np.sqrt(seconds)
        return sd * np.array([self._rng(c, purpose).standard_normal(len(seconds)) for c in range(3)])

    def checkpoint(self) -> dict[str, Any]:
        """State to resume from: that at the start of the present slow block."""
        return {"block": self._start.block, "bank": self._start.bank.tolist(), "walk": self._start.walk.tolist()}

    def resume(self, state: dict[str, Any]) -> None:
        """Go on from the state of a checkpoint."""
        bank = np.array(state["bank"], dtype=np.float64).reshape(-1, 3)
        self._next = SlowState(int(state["block"]), bank, np.array(state["walk"], dtype=np.float64))
        self._start = self._next
        self._slow_block = -1
        self._blocks.forget()

    def _rng(self, channel: int, process: str, block: int = 0) -> np.random.Generator:
        name = channel, process
        if name not in self._streams:
            self._streams[name] = KeyedBlocks(self._seed, *self._labels, *name)
        return self._streams[name].at(block)

    def _draws(self, process: str, shape: tuple[int, ...], block: int) -> Array:
        """Draw standard normal numbers, channel by channel, shape (*shape, 3)."""
        return np.stack([self._rng(c, process, block).standard_normal(shape) for c in range(3)], axis=-1)

    def _first_state(self) -> SlowState:
        members = len(self._bank.times_s)
        bank = np.zeros((members, 3))
        if any(self._truth.bias_instability):
            bank = self._draws("flicker start", (members,), 0)
        return SlowState(0, bank, np.zeros(3))

    def _fill_block(self, block: int, noise: Array) -> None:
        """Write the noise increments of one canonical block to `noise`, shape (3, ticks of a block)."""
        slow_block, part = divmod(block, CELLS_PER_SLOW_BLOCK // CELLS_PER_WHITE_BLOCK)
        slow = self._slow_rates(slow_block)
        cells = slow[:, part * CELLS_PER_WHITE_BLOCK : (part + 1) * CELLS_PER_WHITE_BLOCK]
        noise.reshape(3, CELLS_PER_WHITE_BLOCK, -1)[...] = (cells / self.rate_hz)[:, :, None]
        for channel, walk in enumerate(self._truth.random_walk):
            if walk > 0.0:
                self._rng(channel, "random walk", block).standard_normal(out=self._draw)
                self._draw *= walk / sqrt(self.rate_hz)
                noise[channel] += self._draw
        self._residue.add_block(block, noise)

    def _slow_rates(self, block: int) -> Array:
        """Compute the cell means of all slow processes in one slow block, shape (3, CELLS_PER_SLOW_BLOCK) [rate]."""
        while self._slow_block != block:
            if self._next.block > block:
                raise ValueError(f"noise block {block} has passed: time goes forward only")
            self._start = self._next
            self._slow, self._next = self._slow_step(self._start)
            self._slow_block = self._start.block
        return self._slow

    def _slow_step(self, state: SlowState) -> tuple[Array, SlowState]:
        truth, cells, bank = self._truth, CELLS_PER_SLOW_BLOCK, self._bank
        end_bank, end_walk = state.bank, state.walk
        rates = self._deterministic(state.block)
        residue = np.zeros(3)
        if any(truth.bias_instability):
            low, high = truth.flicker_band_s
            variance = np.array(truth.bias_instability) ** 2 / pi * log(high / low) / len(bank.times_s)
            sums, end_bank = self._bank_cells(state)
            rates += np.sqrt(variance) * sums
            residue += variance * np.sum(bank.residue_variance)
        if any(truth.rate_random_walk):
            walk = np.array(truth.rate_random_walk)
            steps = walk * sqrt(self.cell_s) * self._draws("rate random walk", (cells,), state.block)
            path = np.concatenate([state.walk[None], state.walk + np.cumsum(steps, axis=0)])
            rates += 0.5 * (path[:-1] + path[1:])
            end_walk = path[-1]
            residue += walk**2 * self.cell_s / 12.0
        if np.any(residue > 0.0):
            rates += np.sqrt(residue) * self._draws("cell residue", (cells,), state.block)
        return np.ascontiguousarray(rates.T), SlowState(state.block + 1, end_bank, end_walk)

    def _bank_cells(self, state: SlowState) -> tuple[Array, Array]:
        """Sum over the bank of ``h·(x₀+x₁)`` in each cell, shape (cells, 3), and the bank's state at the end."""
        with IMPORTING:
            from scipy.signal import lfilter  # half a second to import: a service that starts does not wait for it

        bank = self._bank
        draws = self._draws("flicker", (len(bank.times_s), CELLS_PER_SLOW_BLOCK), state.block)
        sums = np.zeros((CELLS_PER_SLOW_BLOCK, 3))
        end = np.empty_like(state.bank)
        for m, decay in enumerate(bank.decay):
            gain = sqrt(-np.expm1(-2.0 * self.cell_s / bank.times_s[m]))
            path: Array = np.asarray(
                lfilter([gain], [1.0, -decay], draws[m], axis=0, zi=decay * state.bank[m : m + 1])[0]
            )
            before = np.concatenate([state.bank[m : m + 1], path[:-1]])
            sums += bank.weight[m] * (before + path)
            end[m] = path[-1]
        return sums, end

    def _deterministic(self, block: int) -> Array:
        """Ramp, start-up and self-heating as cell means, (cells, 3): ``R·t + Σ A·(T/Δ)(1 − e^{−Δ/T})·e^{−t₀/T}``."""
        cells = block * CELLS_PER_SLOW_BLOCK + np.arange(CELLS_PER_SLOW_BLOCK, dtype=np.float64)
        begin = cells[:, None] * self.cell_s
        rates: Array = np.array(self._truth.rate_ramp) * (begin + 0.5 * self.cell_s)
        for amplitude, time_s in self._truth.transients:
            if any(amplitude):
                weight = -expm1(-self.cell_s / time_s) * time_s / self.cell_s
                np.add(rates, weight * np.array(amplitude) * np.exp(-begin / time_s), out=rates)
        return rates


class DitherResidue:
    """Residue of the mechanical dither after the notch filter: ``A·sin(2πft + φ)`` on each channel's integrated output.

    φ is drawn independently for each launch. Seen at the ticks only, so a frequency above half the sample rate shows
    itself where it folds to. An increment is ``2A·sin(πf/r)·cos(2πf(k + ½)/r + φ)`` (tick k, rate r); within a block it
    is a table of cosines and sines turned by the phase at the block's beginning.
    """

    def __init__(self, truth: TriadTruth, rate_hz: float, block_ticks: int, key: tuple[int, int, str]) -> None:
        self._amplitude = np.array(truth.dither_residue)
        self._cycles = np.array(truth.dither_frequency_hz) / rate_hz
        self._phase = np.zeros(3)
        if any(truth.dither_residue):
            self._phase = keyed_generator(*key, "dither residue").uniform(0.0, 2.0 * pi, 3)
        self._block_ticks = block_ticks

    def angle(self, ticks: Array) -> Array:
        """The residue at the end of each of some ticks, counted from power-up, shape (3, n) [rate·s]."""
        turns = np.mod(self._cycles[:, None] * ticks, 1.0)
        return self._amplitude[:, None] * np.sin(2.0 * pi * turns + self._phase[:, None])

    def add_block(self, block: int, noise: Array) -> None:
        """Add the increments of one canonical block to `noise`, shape (3, ticks of a block) [rate·s]."""
        for channel, (cosine, sine) in self._tables:
            phase = 2.0 * pi * fmod(self._cycles[channel] * self._block_ticks * block, 1.0) + self._phase[channel]
            noise[channel] += cosine * cos(phase) + sine * sin(phase)

    @cached_property
    def _tables(self) -> list[tuple[int, Array]]:
        """Channel, and its increments in a block for phases of 0 and 90°, (2, ticks); none without residue."""
        middle = 2.0 * pi * (np.arange(self._block_ticks) + 0.5)
        tables: list[tuple[int, Array]] = []
        for channel in np.flatnonzero(self._amplitude).tolist():
            turn, swing = middle * self._cycles[channel], 2.0 * self._amplitude[channel]
            table = np.array([np.cos(turn), -np.sin(turn)]) * (swing * np.sin(pi * self._cycles[channel]))
            tables.append((channel, table))
        return tables
