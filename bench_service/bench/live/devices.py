"""Reads a bench's devices for its live state, and remembers since when each status word is as it is."""

from bench_service.bench.live.values import LiveDevices, LiveStatus
from bench_service.wall_clock import now
from procedures.bench import Bench
from procedures.bench.device import Status


class DeviceReadings:
    """Reads table, supply and chamber of one bench for its live state, and keeps since when each status word is as it
    is. Commands nothing.
    """

    def __init__(self, bench: Bench) -> None:
        self._bench = bench
        self._status: dict[tuple[str, str], LiveStatus] = {}

    async def read(self) -> LiveDevices:
        """Read table, supply and chamber once: encoder angles, voltage and current, temperature, status words. Raises
        `BenchError`.
        """
        bench = self._bench
        table, supply = await bench.turntable.read(), await bench.supply.read()
        chamber = None if bench.chamber is None else await bench.chamber.read()
        return LiveDevices(
            table.angles.outer_deg,
            table.angles.middle_deg,
            table.angles.inner_deg,
            table.moving,
            supply.on,
            chamber,
            self._statuses(
                turntable=table.status,
                supply=supply.status,
                chamber=() if chamber is None else chamber.status,
                unit=bench.imu.status(),
            ),
            table.rates_deg_s,
            supply.voltage_v,
            supply.current_a,
        )

    def _statuses(self, **found: Status) -> tuple[LiveStatus, ...]:
        """The status words with the moment from which each is as it is."""
        words = {(device, word.name): word for device, status in found.items() for word in status}
        kept: dict[tuple[str, str], LiveStatus] = {}
        for (device, name), word in words.items():
            old = self._status.get((device, name))
            same = old is not None and (old.raw, old.bits) == (word.raw, word.bits)
            kept[device, name] = old if same and old else LiveStatus(device, name, word.raw, word.bits, now())
        self._status = kept
        return tuple(kept.values())
