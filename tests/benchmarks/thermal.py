"""``python -m tests.benchmarks.thermal``: what chamber, thermometers, regimes and fit cost, and the whole world.

The world: 36 hours at 100 Hz, six channels and five temperatures, simulated and stored in SQLite, and beside it the
same without temperatures (aim: well under 20 s on an idle core).
"""

import os

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")  # before numpy

import asyncio
import resource
import tempfile
import time
from collections.abc import Callable
from pathlib import Path

from bench_service.model.records import NewRecording
from bench_service.persistence import open_stores
from bench_service.wall_clock import monotonic_s
from procedures.analysis.thermal.fit import fit_correction
from procedures.analysis.thermal.regime import regimes
from procedures.core.recording import Station
from simulators.chamber.device import SimChamber
from simulators.chamber.plant import ChamberPlant
from simulators.chamber.thermometers import Thermometers
from simulators.truth.thermal import ChamberTruth, NetworkTruth, UnitThermalTruth
from simulators.world import WorldConfig, build
from tests.validation.thermal_population import runs_of
from tests.validation.thermal_rig import THESIS_LIKE, reference_c

HOURS_12 = 12 * 3600
ROUNDS = 3


def timed(what: str, work: Callable[[], object]) -> None:
    """Print the median of a few rounds."""
    took: list[float] = []
    for _ in range(ROUNDS):
        begun = monotonic_s()
        work()
        took.append(monotonic_s() - begun)
    print(f"  {what}: {sorted(took)[ROUNDS // 2]:.2f} s (median of {ROUNDS})")


def slices() -> None:
    """The port in slices of ten seconds at 400 Hz, as the world's clock calls it."""
    chamber = SimChamber(ChamberTruth(), UnitThermalTruth(), 1, 400.0, lambda: 0.0)
    for _ in range(HOURS_12 // 10):
        chamber.advance(4000)


async def _world(hours: float, warm: bool, folder: Path | None) -> None:
    """One launch of so many hours at 100 Hz, stored where a folder is given."""
    bench = build(WorldConfig(sample_rate_hz=100.0, thermal=warm))
    await bench.supply.switch_on()
    if bench.chamber is not None:
        await bench.chamber.command(60.0, 1.0)
    stream = bench.imu.record(hours * 3600.0, Station(0, "launch", temperatures=warm))
    if folder is None:
        async for _ in stream.blocks:
            pass
        return
    stores, database = open_stores(f"sqlite:///{folder / 'bench.sqlite'}")
    writer = stores.recordings.open(NewRecording("SIM-0001", stream.channels, stream.rate_hz, 0.0, simulated=True))
    async for block in stream.blocks:
        writer.write(block)
    writer.seal(bench.checkpoint())
    database.dispose()


def world(hours: float = 36.0) -> None:
    """Print what a launch costs with and without temperatures, alone and stored: wall and processor time."""
    for what, warm, stored in (
        ("world without temperatures, simulated", False, False),
        ("world with its chamber, simulated", True, False),
        ("world with its chamber, simulated and stored", True, True),
    ):
        with tempfile.TemporaryDirectory() as folder:
            begun, used = monotonic_s(), time.process_time()
            asyncio.run(_world(hours, warm, Path(folder) if stored else None))
            print(f"  {what}: {monotonic_s() - begun:.1f} s ({time.process_time() - used:.1f} s of processor)")


def main() -> None:
    """Everything, one after the other."""
    truth = UnitThermalTruth()
    path = ChamberPlant(ChamberTruth(), NetworkTruth(), 1).run(HOURS_12)
    case = Thermometers(truth.thermometers, 1, 22.0).read(0, path)[:, 0] * 0.0625
    runs, _ = runs_of(truth, THESIS_LIKE, 1)
    print("thermal cycle, 12 h at one sample a second")
    timed("plant", lambda: ChamberPlant(ChamberTruth(), NetworkTruth(), 1).run(HOURS_12))
    timed("five thermometers", lambda: Thermometers(truth.thermometers, 1, 22.0).read(0, path))
    timed("port, plant and thermometers in slices of 10 s", slices)
    timed("regime indicator, sample by sample", lambda: regimes(case, 1.0))
    timed("fit of three axes from three runs, with order test", lambda: fit_correction(runs, reference_c(truth)))
    print("36 h at 100 Hz")
    world()
    print(f"  peak memory {resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024:.0f} MB")


if __name__ == "__main__":
    main()
