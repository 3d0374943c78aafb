"""The problem document of RFC 9457: the shape of every refusal."""

from typing import Annotated, Any

from pydantic import BaseModel, BeforeValidator, Field

from bench_service.formats.plain_json import shown

Shown = Annotated[str, BeforeValidator(shown)]
"""Text as a message may quote it, with its unsendable characters escaped."""


class FieldError(BaseModel):
    """A faulty field of a request: its path, what is wrong, and the value that was sent."""

    field: Shown = Field(description="Path of the field, for example parameters.dwell_s")
    message: Shown = Field(description="What is wrong, with the allowed range and the way out")
    value: Any = Field(default=None, description="Value that was given; text where JSON has no such number")


class Problem(BaseModel):
    """Problem document of RFC 9457, with the fields that caused the error."""

    type: str = Field("about:blank", description="Kind of error, a relative reference")
    title: str
    status: int
    detail: Shown
    instance: Shown = ""
    errors: list[FieldError] = Field(default_factory=list[FieldError])
    lost: list[Shown] = Field(default_factory=list[Shown], description="Combinations that a plan cannot determine")
