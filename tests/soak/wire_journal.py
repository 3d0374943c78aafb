"""Journal of a served bench: every request that the table got, and every sample that the unit sent."""

import re
from collections import Counter
from collections.abc import Iterable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from simulators.served.unit import Stream
from tests.conformance.served import Served

DEMAND = re.compile(r":demand:position \d+,(-?[0-9.]+)$")
KEY_ROWS = 3
"""Number of samples by which a recording's place in what was sent is looked up."""


class _Overheard:
    """Language of a device that notes each request before it answers."""

    def __init__(self, talker: Any, note: Any) -> None:
        self._talker, self._note = talker, note

    def take(self, buffer: bytearray) -> bytes | None:
        return self._talker.take(buffer)

    def answer(self, request: bytes) -> bytes:
        self._note(request.decode("latin-1"))
        return self._talker.answer(request)


class Journal:
    """Witness at the served end of the wires."""

    def __init__(self, behind: Served) -> None:
        self._angles: Counter[str] = Counter()
        self.requests = self.demands = 0
        self._blocks: list[NDArray[np.int32]] = []
        self._whole: NDArray[np.int32] | None = None
        self._places: dict[bytes, list[int]] = {}
        behind.do(self._listen)

    def _listen(self, bench: Any) -> None:
        port = bench.ports["turntable"]
        port._talker = _Overheard(port._talker, self._note)
        (stream,) = (tape for tape in bench.bench.imu._tapes.running if isinstance(tape, Stream))
        send = stream.put

        def put(counts: Any) -> None:
            self._blocks.append(np.array(np.asarray(counts)[:, :6], dtype=np.int32))
            send(counts)

        stream.put = put  # type: ignore[method-assign]

    def _note(self, request: str) -> None:
        self.requests += 1
        if (found := DEMAND.match(request.strip())) is not None:
            self.demands += 1
            self._angles[found[1]] += 1

    def twice(self, angles: Iterable[str]) -> list[tuple[str, int]]:
        """The angles, as texts, that were demanded more than once, and how often."""
        return [(text, self._angles[text]) for text in sorted(angles) if self._angles[text] > 1]

    def sent(self, rows: NDArray[np.int32]) -> bool:
        """Return whether a recording's samples (n, 6) were sent, in this order and with nothing between."""
        if self._whole is None or len(self._blocks) > 1:
            self._whole = np.concatenate(self._blocks)
            self._blocks = [self._whole]
            keys = np.lib.stride_tricks.sliding_window_view(self._whole, KEY_ROWS, axis=0)
            self._places = {}
            for at, key in enumerate(np.ascontiguousarray(keys.transpose(0, 2, 1))):
                self._places.setdefault(key.tobytes(), []).append(at)
        first = np.ascontiguousarray(rows[:KEY_ROWS]).tobytes()
        return any(np.array_equal(self._whole[at : at + len(rows)], rows) for at in self._places.get(first, []))
