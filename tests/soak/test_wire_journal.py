"""The witness of a soak over wires sees a demand that came twice, and a recording that lacks a sample."""

from types import SimpleNamespace
from typing import Any

import numpy as np

from simulators.served.unit import Stream
from tests.soak.wire_journal import Journal


class _Talker:
    def take(self, buffer: bytearray) -> bytes | None:
        return None

    def answer(self, request: bytes) -> bytes:
        return b"OK"


def _overheard() -> tuple[Journal, Any, Any]:
    stream = Stream.__new__(Stream)
    sent: list[Any] = []
    stream.put = sent.append  # type: ignore[method-assign]
    imu = SimpleNamespace(_tapes=SimpleNamespace(running=[stream]))
    port = SimpleNamespace(_talker=_Talker())
    bench = SimpleNamespace(ports={"turntable": port}, bench=SimpleNamespace(imu=imu))
    journal = Journal(SimpleNamespace(do=lambda call: call(bench)))  # type: ignore[arg-type]
    return journal, port, stream


def test_a_demand_that_came_twice_is_seen() -> None:
    journal, port, _ = _overheard()
    for request in (b":demand:position 2,12.34560", b":demand:position? 2", b":demand:position 2,0.00000"):
        port._talker.answer(request)
    assert journal.twice({"12.34560"}) == []
    port._talker.answer(b":demand:position 2,12.34560")
    assert journal.twice({"12.34560"}) == [("12.34560", 2)]
    assert (journal.demands, journal.requests) == (3, 4)


def test_a_recording_that_lacks_a_sample_is_no_stretch() -> None:
    journal, _, stream = _overheard()
    counts = np.random.default_rng(1).integers(-3, 4, (500, 11)).astype(np.int32)
    for begin in range(0, 500, 50):
        stream.put(counts[begin : begin + 50])
    rows = counts[120:300, :6]
    assert journal.sent(rows)
    assert not journal.sent(np.delete(rows, 90, axis=0))
    assert not journal.sent(rows + np.array([0, 0, 0, 0, 0, 1], dtype=np.int32))
