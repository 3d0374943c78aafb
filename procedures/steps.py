"""Shared verbs over a bench: what several procedures do in the same way."""

from procedures.bench import Bench
from procedures.bench.imu import Stream
from procedures.core.recording import Station


async def record_station(bench: Bench, station: Station) -> Stream:
    """Power off for as long as the station wants, on (no-op where it is on), move, settle, begin its recording."""
    if station.power_off_s > 0.0:
        await bench.supply.switch_off()
        await bench.clock.sleep(station.power_off_s)
    await bench.supply.switch_on()
    if station.angles is not None:
        await bench.turntable.move_to(station.angles)
    await bench.clock.sleep(station.settle_s)
    return bench.imu.record(station.record_s, station)
