"""Field types of request bodies: every one bounded, unknown ones refused. Units are in the field names."""

from typing import Annotated

from pydantic import BaseModel, ConfigDict, Field

NAME = Field(min_length=1, max_length=100, pattern=r"^[^\x00-\x1f]+$")
Labels = dict[Annotated[str, NAME], Annotated[str, NAME]]


class Request(BaseModel):
    """Base of request bodies: unknown fields are refused."""

    model_config = ConfigDict(extra="forbid")
