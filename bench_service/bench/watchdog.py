"""The watchdog on a bench's device links: a device that is silent for too long counts as disconnected.

It counts real time, in steps between the looks of its caller, so neither a wall clock that jumps nor a machine that was
suspended makes a device silent. It knows no device: only verbs as they begin and end (`bench_service.bench.observed`).
"""

from collections.abc import Mapping
from dataclasses import dataclass
from math import inf
from threading import Lock
from typing import Any

from procedures.bench.clock import Clock

MOTIONS = frozenset({"turntable.move_to", "turntable.settle", "turntable.make_safe"})
"""Verbs that answer at the end of a motion."""
MAKE_SAFE = ".make_safe"
"""End of the names of verbs that make a device safe."""
UNWATCHED = frozenset({"imu.stream", "operator.set_by_hand"})
"""Verbs without a time limit: a recording's blocks are watched one by one, and a person may take any time."""


@dataclass(frozen=True)
class TimeLimits:
    """Time limits for the answers of devices [s, real time].

    On a simulated bench every verb has `simulated_s`, and an advancing clock is a sign of life: bench time may pass
    slower than real time there.
    """

    verb_s: float = 5.0
    """Limit for a verb without motion."""
    block_s: float = 2.0
    """Limit for the next block of a recording."""
    motion_s: float = 120.0
    """Limit for a motion: longer than the longest, and the table's own limit comes first."""
    simulated_s: float = 5.0
    margin_s: float = 2.0
    """Time beyond the longest declared time of a device to be safe: each device has a deadline of its own before it."""


class Watchdog:
    """A `bench_service.bench.observed.Observer` that detects silent devices; its caller polls `silence`."""

    def __init__(
        self, clock: Clock, simulated: bool, limits: TimeLimits, safe_s: Mapping[str, float] | None = None
    ) -> None:
        """Set up; `safe_s`: the declared times of devices to be safe [s] (`procedures.bench.Bench.safe_s`).

        Where there are any, no device's `make_safe` is silent before the longest of them has passed: a watchdog that
        ends it ends that of all devices, and the table may brake meanwhile.
        """
        self._safe_s = max(limits.verb_s, *safe_s.values()) + limits.margin_s if safe_s else None
        self._clock = clock
        self._simulated = simulated
        self._patience = limits
        self._mutex = Lock()
        self._waiting: dict[str, float] = {}
        self._signs = 0
        self._answered = "none so far"
        self._seen: tuple[int, float] = (-1, 0.0)
        self._silent_s = 0.0

    def begin(self, verb: str, arguments: Mapping[str, Any]) -> None:
        if verb.endswith(MAKE_SAFE) and self._safe_s is not None:
            self._wait_for(verb, self._safe_s)
        elif verb not in UNWATCHED:
            self._wait_for(verb, self._patience.motion_s if verb in MOTIONS else self._patience.verb_s)

    def end(self, verb: str, failure: BaseException | None) -> None:
        if verb not in UNWATCHED:
            self._answer(verb)

    def asked(self, device: str) -> None:
        self._wait_for(f"{device}.block", self._patience.block_s)

    def heard(self, device: str) -> None:
        self._answer(f"{device}.block")

    def silence(self, looked_s: float, longest_s: float) -> str | None:
        """A sentence that names the device that was silent for too long; None: no device was.

        `looked_s`: the time since the last look; no more than `longest_s` of it counts, because a process that was
        suspended looks late at devices that it could not hear.
        """
        with self._mutex:
            seen = (self._signs, self._clock.now_s() if self._simulated else 0.0)
            self._silent_s = 0.0 if seen != self._seen else self._silent_s + min(looked_s, longest_s)
            self._seen = seen
            verb, limit_s = min(self._waiting.items(), key=lambda item: item[1], default=("", inf))
            if self._silent_s <= limit_s:
                return None
            device = verb.partition(".")[0]
            return f"the {device} has not answered {verb} for {limit_s:g} s; the last answer was to {self._answered}"

    def _wait_for(self, verb: str, limit_s: float) -> None:
        with self._mutex:
            self._waiting[verb] = self._patience.simulated_s if self._simulated else limit_s
            self._signs += 1

    def _answer(self, verb: str) -> None:
        with self._mutex:
            self._waiting.pop(verb, None)
            self._answered = verb
            self._signs += 1
