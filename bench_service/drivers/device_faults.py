"""Faults that are injected into a simulated bench's devices for exercises: never into real ones."""

import json
from collections.abc import Mapping
from fnmatch import fnmatchcase
from random import Random
from threading import Event
from typing import Any, Literal

from pydantic import BaseModel, ConfigDict, Field, ValidationError, model_validator

from bench_service.drivers.device_cables import DeviceCables
from bench_service.model.errors import Misconfigured
from procedures.bench.errors import DeviceFault, Disconnected

HANG_S = 3600.0
"""Time for which a hanging device gives no answer [s]: longer than any caller waits."""


class FaultRule(BaseModel):
    """A fault that may occur when a verb begins: which verb, which kind, with which probability."""

    model_config = ConfigDict(frozen=True, extra="forbid")

    verb: str = Field(min_length=1)
    """Verb as in the devices' journal, with wildcards: "turntable.move_to", "supply.*", "imu.block" (each block)."""
    kind: Literal["hang", "disconnect", "fault", "lost"]
    """hang: no answer at all (the thread that asked is lost, as in a vendor's library); disconnect: a lost link, which
    a new one replaces; fault: a fault of the device; lost: a lost link that cannot be made anew until the cable is
    plugged in again."""
    probability: float = Field(gt=0.0, le=1.0)
    """Probability of the fault at each begin of the verb."""
    lasts_s: float | None = Field(None, gt=0.0)
    """Duration of a lost link [s, real time]; None: until a person deletes its file (see `device_cables`)."""

    @model_validator(mode="after")
    def _only_a_lost_link_lasts(self) -> "FaultRule":
        if self.lasts_s is not None and self.kind != "lost":
            raise ValueError(f"lasts_s applies to a lost link only, not to kind {self.kind!r}")
        return self


class FaultPlan(BaseModel):
    """Faults of a simulated bench's devices, and the seed of their random numbers."""

    model_config = ConfigDict(frozen=True, extra="forbid")

    seed: int = 0
    rules: tuple[FaultRule, ...]

    @classmethod
    def parse(cls, text: str) -> "FaultPlan":
        """Return the plan in a JSON text such as ``{"seed": 7, "rules": [{"verb": "turntable.*", "kind": "hang",
        "probability": 0.1}]}``.

        Raises `Misconfigured` naming the field.
        """
        try:
            return cls.model_validate(json.loads(text))
        except ValidationError as error:
            first = error.errors()[0]
            where = ".".join(map(str, first["loc"]))
            raise Misconfigured(f"BENCH_DEVICE_FAULTS: {where} = {first['input']!r}: {first['msg']}") from error
        except ValueError as error:
            raise Misconfigured(f"BENCH_DEVICE_FAULTS is not JSON: {error}") from error


class DeviceFaults:
    """Draws the faults of one opening of the devices; each opening has its own random numbers, the same in each
    exercise.
    """

    def __init__(self, plan: FaultPlan, opening: str, cables: DeviceCables) -> None:
        self._rules = plan.rules
        self._chance = Random(f"{plan.seed} {opening}")
        self._cables = cables

    def strike(self, verb: str, arguments: Mapping[str, Any]) -> None:
        """Inject a fault, if one is due, as a verb begins. Raises `DeviceFault`, `Disconnected`, or does not return."""
        for rule in self._rules:
            if fnmatchcase(verb, rule.verb) and self._chance.random() < rule.probability:
                if rule.kind == "hang":
                    Event().wait(HANG_S)
                if rule.kind == "fault":
                    raise DeviceFault(f"{verb} {json.dumps(dict(arguments))}: an injected fault")
                if rule.kind == "lost":
                    device = verb.partition(".")[0]
                    self._cables.cut(device, "an injected fault", rule.lasts_s)
                    self._cables.need(device)
                raise Disconnected(f"{verb}: the link is lost, an injected fault")
