"""Recordings of white counts of one gyro channel, stored as imports are: evidence for many analyses."""

import numpy as np

from bench_service.evidence.stores import EvidenceStores
from bench_service.model.records import NewRecording
from procedures.core.recording import Channel, Quantity
from procedures.core.unit import Unit

CHANNEL = Channel("gyro_x", Quantity.ANGULAR_RATE, "rad/s", 1e-6)


def store_white(stores: EvidenceStores, count: int, samples: int, unit: str = "IMU-1", seed: int = 0) -> list[str]:
    """Store recordings of (samples, 1) counts at 100 Hz, each of other numbers, and their unit; return their ids."""
    stores.units.put_unit(Unit(unit, 100.0, (CHANNEL,)))
    made: list[str] = []
    for number in range(count):
        random = np.random.default_rng([seed, number])
        writer = stores.recordings.open(NewRecording(unit, (CHANNEL,), 100.0, 0.0, simulated=True))
        writer.write(np.rint(random.normal(0.0, 500.0, (samples, 1))).astype(np.int32))
        made.append(writer.seal().id)
    return made
