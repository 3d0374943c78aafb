"""PORTS, the interfaces of a bench. A driver or a simulator implements them; a procedure sees only these."""

from dataclasses import dataclass, field
from typing import Any, Final

from procedures.bench.chamber import Chamber
from procedures.bench.clock import Clock
from procedures.bench.current_source import CurrentSource
from procedures.bench.description import BenchDescription
from procedures.bench.device import Device, DeviceIdentity, StatusWord
from procedures.bench.environment import Environment
from procedures.bench.imu import Imu
from procedures.bench.needs import BenchNeeds
from procedures.bench.operator import Operator
from procedures.bench.supply import Supply
from procedures.bench.turntable import Turntable

__all__ = [
    "SAFE_ORDER",
    "Bench",
    "BenchDescription",
    "BenchNeeds",
    "Chamber",
    "Clock",
    "CurrentSource",
    "Device",
    "DeviceIdentity",
    "Environment",
    "Imu",
    "Operator",
    "StatusWord",
    "Supply",
    "Turntable",
]

SAFE_ORDER: Final = ("turntable", "chamber", "current_source", "supply")
"""Devices that are made safe, in this order on a simulated bench: what moves first, what only wastes energy last. On a
bench with real devices (`Bench.safe_s`) all are made safe at the same time."""


@dataclass
class Bench:
    """The devices around one unit, and the one way to leave them safe; `chamber` is None where there is none."""

    description: BenchDescription
    clock: Clock
    turntable: Turntable
    imu: Imu
    supply: Supply
    chamber: Chamber | None = None
    operator: Operator | None = None
    current_source: CurrentSource | None = None
    environment: Environment | None = None
    """Conditions of the room; None: nobody knows them."""
    safe_s: dict[str, float] = field(default_factory=dict[str, float])
    """Time within which each real device must be safe [s]; empty: devices are made safe one after the other."""

    async def make_safe(self) -> None:
        """Stop the table, command the chamber to ambient, take the current away, switch the unit off, and wait until
        each reads back so.

        Every device is tried; raises an `ExceptionGroup` of what failed.
        """
        failures: list[Exception] = []
        for device in SAFE_ORDER:
            try:
                if (there := getattr(self, device)) is not None:
                    await there.make_safe()
            except Exception as failure:
                failures.append(failure)
        if failures:
            raise ExceptionGroup("the bench could not be made safe", failures)

    def checkpoint(self) -> dict[str, Any] | None:
        """Return the state from which a simulated bench can resume after a restart, as JSON; None for a real bench,
        which never stops.
        """
        return None

    def close(self) -> None:
        """Give the devices' links back; the bench cannot be used after. One without links has nothing to do."""
