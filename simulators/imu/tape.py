"""Buffers of counts between the sensors that make them and the recordings that read them."""

from collections.abc import AsyncIterator, Callable
from dataclasses import dataclass, field

import numpy as np

from procedures.bench.errors import DeviceFault, NotPowered
from simulators.clock import SimClock
from simulators.imu.counter import Counts

BLOCK_S = 10.0


@dataclass
class Tape:
    """Buffer of counts that a recording has not read yet; it keeps the first `columns` channels."""

    columns: int
    blocks: list[Counts] = field(default_factory=list)
    held: int = 0
    broken: bool = False

    def put(self, counts: Counts) -> None:
        """Append the next counts, (ticks, channels)."""
        self.blocks.append(counts if counts.shape[1] == self.columns else np.array(counts[:, : self.columns]))
        self.held += len(counts)

    def take(self, count: int) -> Counts:
        """Take the oldest counts, at most `count` ticks."""
        whole = np.concatenate(self.blocks) if len(self.blocks) != 1 else self.blocks[0]
        self.blocks = [whole[count:]] if len(whole) > count else []
        self.held = len(whole) - count
        return whole[:count]


class Tapes:
    """The running recordings of one data link."""

    def __init__(self, clock: SimClock, launch: Callable[[], int], block_s: float | None = None) -> None:
        """Connect to the clock; `launch` returns the power-up's number, 0: off; `block_s` replaces `BLOCK_S`."""
        self._clock, self._launch, self._block_s = clock, launch, block_s
        self.running: list[Tape] = []

    def stop(self) -> None:
        """Break the running recordings, because the unit lost its power."""
        for tape in self.running:
            tape.broken = True

    def need_power(self, tape: Tape | None = None) -> None:
        """Check that the unit has power. Raises `NotPowered`, also if it was off at any time during the recording.
        `tape`: of a running recording; None: none runs.
        """
        if self._launch() == 0 or (tape is not None and tape.broken):
            raise NotPowered("the unit is switched off")

    def blocks(self, samples: int, start: int, columns: int) -> AsyncIterator[Counts]:
        """The blocks of a recording that begins at tick `start`; time passes while they are read.

        In a world that follows another clock the counts are kept from now on: time passes there before they are read.
        """
        tape = Tape(columns)
        if self._clock.following:
            self.running.append(tape)
        return self._read(tape, samples, start)

    async def _read(self, tape: Tape, samples: int, start: int) -> AsyncIterator[Counts]:
        if not self._clock.following:
            if self._clock.ticks != start:
                raise DeviceFault(
                    "samples were lost: time passed between the recording's beginning and its first reading"
                )
            self.running.append(tape)
        longest = max(1, int((BLOCK_S if self._block_s is None else self._block_s) * self._clock.rate_hz))
        try:
            while samples > 0:
                block = min(samples, longest)
                if tape.held < block:
                    self.need_power(tape)
                    await self._clock.pass_ticks(block - tape.held)
                if tape.held < block:
                    self.need_power(tape)
                    raise DeviceFault("the unit stopped sending")
                samples -= block
                yield tape.take(block)
        finally:
            self.running.remove(tape)
