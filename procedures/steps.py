"""Shared verbs over a bench: what several procedures do in the same way."""

from procedures.bench import Bench
from procedures.bench.imu import Stream
from procedures.core.recording import Station


async def record_station(bench: Bench, station: Station) -> Stream:
    """Power on (no-op where it is on), move, settle, and begin the station's recording."""
    await bench.supply.switch_on()
    if station.angles is not None:
        await bench.turntable.move_to(station.angles)
    await bench.clock.sleep(station.settle_s)
    return bench.imu.record(station.record_s, station)
