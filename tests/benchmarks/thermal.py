"""``python -m tests.benchmarks.thermal``: what twelve hours of chamber, thermometers, regimes and fit cost."""

import os

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")  # before numpy

import resource
from collections.abc import Callable

from bench_service.wall_clock import monotonic_s
from procedures.analysis.thermal.fit import fit_correction
from procedures.analysis.thermal.regime import regimes
from simulators.chamber.device import SimChamber
from simulators.chamber.plant import ChamberPlant
from simulators.chamber.thermometers import Thermometers
from simulators.truth.thermal import ChamberTruth, NetworkTruth, UnitThermalTruth
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
    print(f"  peak memory {resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024:.0f} MB")


if __name__ == "__main__":
    main()
