"""What a client may send: request bodies, every field bounded, unknown ones refused. Units are in the field names."""

from typing import Annotated, Any

from pydantic import AwareDatetime, BaseModel, ConfigDict, Field

from procedures.core.recording import Channel
from procedures.core.unit import TriadRecord

NAME = Field(min_length=1, max_length=100, pattern=r"^[^\x00-\x1f]+$")
Labels = dict[Annotated[str, NAME], Annotated[str, NAME]]


class Request(BaseModel):
    """Base of request bodies: unknown fields are refused."""

    model_config = ConfigDict(extra="forbid")


class PreviewRequest(Request):
    """What a plan would be worth."""

    unit: str = NAME
    bench: Annotated[str, NAME] | None = None
    parameters: dict[str, Any] = Field(default_factory=dict[str, Any])


class JobSubmission(PreviewRequest):
    """A job to be done."""

    procedure: str = NAME
    priority: int = Field(10, ge=1, le=1000, description="Smaller runs first")
    labels: Labels = Field(default_factory=Labels, max_length=50)
    seed: int | None = Field(None, ge=0, lt=2**48, description="Of a simulated bench: same seed, same bytes")
    retries: int = Field(0, ge=0, le=5, description="How often a fault of the bench is answered by trying again")
    reservation: str | None = Field(None, max_length=100, description="The reservation under which it runs")
    deadline_at: AwareDatetime | None = Field(None, description="No station begins later; the job then fails")


class PromptAnswer(Request):
    """What the person at the bench says to what a job asks."""

    done: bool = Field(description="It is done; false: it will not be, and the job ends cancelled")
    remark: str = Field("", max_length=500, pattern=r"^[^\x00]*$")


class AnalysisSubmission(Request):
    """A method and what it is to work on."""

    method: str = NAME
    recordings: list[str] = Field(default_factory=list[str], max_length=1000)
    calibrations: list[str] = Field(default_factory=list[str], max_length=1000)
    parameters: dict[str, Any] = Field(default_factory=dict[str, Any])


class Reanalysis(Request):
    """Other parameters for a job's recordings; those left out stay as they were requested."""

    parameters: dict[str, Any] = Field(default_factory=dict[str, Any])


class JobChange(Request):
    """What can be changed of a job while it is queued."""

    priority: int = Field(ge=1, le=1000, description="Smaller runs first")


class StopRequest(Request):
    """Why a bench is stopped."""

    reason: str = Field("stopped by an operator", min_length=1, max_length=500)


class UnitDeclaration(Request):
    """What is declared of a unit (its data sheet), without its serial, which the address has."""

    sample_rate_hz: float = Field(gt=0, le=1e6, allow_inf_nan=False)
    channels: list[Channel] = Field(default_factory=list[Channel], max_length=64)
    gyro: TriadRecord | None = None
    accelerometer: TriadRecord | None = None
    averaging_time_s: float = Field(70.0, gt=0, le=1e6, allow_inf_nan=False)
