"""HTTP schemas of manual mode: leases, demands and their outcomes."""

from datetime import datetime
from typing import Annotated, Any, Literal

from pydantic import BaseModel, Field

from bench_service.api.http.dependencies import By
from bench_service.api.http.fields import NAME, Request
from bench_service.jobs.manual.service import LONGEST_MIN
from bench_service.mapping import copied
from bench_service.model.manual import DemandKind, ManualDemand, ManualLease
from bench_service.wall_clock import now

Minutes = Annotated[float, Field(gt=0.0, le=LONGEST_MIN, allow_inf_nan=False)]
Number = Annotated[float, Field(allow_inf_nan=False)]


class ManualSubmission(Request):
    """Request for manual mode on an idle bench."""

    reason: str = Field(min_length=1, max_length=500, description="Why the bench is driven by hand")
    minutes: Minutes = Field(10.0, description="Duration of the lease [min]; renewing extends it")
    unit: Annotated[str, NAME] | None = Field(None, description="Unit on the table; null: the bench's first one")
    by: By | None = Field(None, description="Holder, where nobody logs in; without it, the client's name")
    reservation: Annotated[str, NAME] | None = Field(None, description="Own reservation of the bench or the unit")


class Renewal(Request):
    """Request to move the end of a lease."""

    minutes: Minutes = Field(10.0, description="Duration from now [min]")
    by: By | None = None


class LeaseEnd(Request):
    """Request to end a lease."""

    by: By | None = None


class _Demand(Request):
    by: By | None = Field(None, description="Holder of the lease, where nobody logs in")


class Home(_Demand):
    """Demand to move all axes to zero. A table whose encoders do not know their zero is homed by a person, at its
    controller.
    """

    kind: Literal["home"]


class GoTo(_Demand):
    """Demand to move axes to angles; an axis that is left out stays where it stands."""

    kind: Literal["go_to"]
    outer_deg: Number | None = None
    middle_deg: Number | None = None
    inner_deg: Number | None = None


class Rate(_Demand):
    """Demand for a constant rate of one axis for a stated time, from rest to rest; a halt ends it earlier."""

    kind: Literal["rate"]
    axis: Literal["outer", "middle", "inner"]
    rate_deg_s: Number
    duration_s: Number
    ramp_s: Number | None = Field(
        None, description="Ramp at begin and end [s]; null: at half of the axis' acceleration"
    )


class Halt(_Demand):
    """Demand to bring the table to rest, from a rate or a move."""

    kind: Literal["halt"]


class ChamberSetPoint(_Demand):
    """Demand to bring the chamber's air to a temperature, at a rate of change."""

    kind: Literal["chamber"]
    temperature_c: Number
    ramp_c_min: Number | None = Field(None, description="null: the fastest that the bench allows")


class SupplyOn(_Demand):
    """Demand to switch the unit's supply on."""

    kind: Literal["supply_on"]
    voltage_v: Number | None = Field(None, description="null: nominal")
    current_a: Number | None = Field(None, description="Current limit; null: nominal")


class SupplyOff(_Demand):
    """Demand to switch the unit's supply off."""

    kind: Literal["supply_off"]


AnyDemand = Annotated[Home | GoTo | Rate | Halt | ChamberSetPoint | SupplyOn | SupplyOff, Field(discriminator="kind")]


class LeaseView(BaseModel):
    """A lease of manual mode. It ends by itself at `until`, and the bench is made safe."""

    id: str
    bench: str
    unit: str
    holder: str
    proven: bool = Field(description="Whether the holder was authenticated; else the name was declared")
    reason: str
    reservation: str | None
    created_at: datetime
    until: datetime
    began_at: datetime | None = Field(description="When the bench's worker took it; null: not yet")
    live: bool = Field(description="Whether demands are taken")
    ended_at: datetime | None
    ended_because: str
    safe: bool | None = Field(description="Whether the bench was left safe; null: the lease has not ended")

    @classmethod
    def of(cls, lease: ManualLease) -> "LeaseView":
        """Convert a lease to its HTTP view."""
        return copied(cls, lease, live=lease.live(now()) and not lease.end_asked)


class LeasePage(BaseModel):
    """One page of leases, newest first."""

    items: list[LeaseView]
    next: str | None = Field(description="Cursor: pass it as `after` for the next page")


class DemandView(BaseModel):
    """A demand of manual mode with its state and its answer."""

    key: str
    lease: str
    kind: DemandKind
    values: dict[str, Any] = Field(description="Values of the demand, with defaults for those that it left out")
    by: str
    at: datetime
    state: str = Field(description='"accepted", "doing", "done", "refused", "failed" or "stopped"')
    over: bool = Field(description="Whether the demand has ended, with any outcome")
    text: str
    field: str | None = Field(description="The field that was refused")
    value: Any
    allowed: str | None = Field(description="Its allowed range")
    ended_at: datetime | None

    @classmethod
    def of(cls, demand: ManualDemand) -> "DemandView":
        """Convert a demand to its HTTP view."""
        return copied(cls, demand, demand.answer, state=demand.state.value, over=demand.state.over)


class DemandPage(BaseModel):
    """One page of a lease's demands, newest first."""

    items: list[DemandView]
    next: str | None = Field(description="Cursor: pass it as `after` for the next page")
