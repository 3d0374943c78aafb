"""Status words in the live state: each with the moment from which it is as it is."""

import asyncio
from types import SimpleNamespace
from typing import Any, cast

from bench_service.bench.live.tap import LiveTap
from bench_service.bench.live.values import BenchLive
from procedures.bench.device import StatusWord
from procedures.bench.supply import SupplyReading
from procedures.bench.turntable import TableReading
from procedures.core.table_angles import TableAngles


class _Bench:
    """A bench whose table shows the given status."""

    chamber = None

    def __init__(self) -> None:
        self.words: tuple[StatusWord, ...] = ()
        self.clock = SimpleNamespace(now_s=lambda: 0.0)
        self.turntable = SimpleNamespace(read=self._table)
        self.supply = SimpleNamespace(read=self._supply)
        self.imu = SimpleNamespace(status=lambda: (StatusWord("status", "0x00"),))

    async def _table(self) -> TableReading:
        return TableReading(0.0, TableAngles(), False, self.words)

    async def _supply(self) -> SupplyReading:
        return SupplyReading(0.0, True, 28.0, 0.9, False, False, 28.0, 3.0)


def test_a_status_word_keeps_its_moment_until_it_changes() -> None:
    bench, said = _Bench(), list[BenchLive]()
    job = SimpleNamespace(id="j", bench="east", stations=(SimpleNamespace(label="o"),), duration_s=0.0)
    job.stations[0].power_off_s = job.stations[0].settle_s = job.stations[0].record_s = 0.0
    tap = LiveTap(cast(Any, job), cast(Any, bench), cast(Any, SimpleNamespace(publish=said.append)))

    def status() -> dict[tuple[str, str], Any]:
        asyncio.run(tap.publish())
        devices = said[-1].devices
        assert devices is not None
        return {(s.device, s.name): s for s in devices.status}

    closed, opened = StatusWord("interlock 1", "Closed"), StatusWord("interlock 1", "Open", ("door",))
    bench.words = (closed,)
    first = status()
    again = status()
    bench.words = (opened,)
    changed = status()
    assert again == first
    assert changed["turntable", "interlock 1"].bits == ("door",)
    assert changed["turntable", "interlock 1"].since > first["turntable", "interlock 1"].since
    assert changed["unit", "status"] == first["unit", "status"]
    bench.words = ()
    assert ("turntable", "interlock 1") not in status()
