"""Targets of messages, as the file of `BENCH_NOTIFY` lists them: mail servers and webhooks, each with its events."""

import tomllib
from pathlib import Path
from typing import Annotated, Literal

from pydantic import BaseModel, ConfigDict, Field, ValidationError

from bench_service.model.errors import Misconfigured

EventKind = Literal["verdict", "stop", "prompt", "trouble", "campaign", "disk", "certificate"]
EVERY: tuple[EventKind, ...] = ("verdict", "stop", "prompt", "trouble", "campaign", "disk", "certificate")
URGENT: tuple[EventKind, ...] = ("stop", "prompt")
"""Kinds that a person waits for or must act on: no limit holds them back."""
Address = Annotated[str, Field(pattern=r"^[^@\s<>]+@[^@\s<>]+$", max_length=254)]


class _Target(BaseModel):
    model_config = ConfigDict(extra="forbid", frozen=True)

    name: str = Field(pattern=r"^[a-z0-9][a-z0-9_-]{0,31}$", description="also the name of its folder of waiting files")
    events: tuple[EventKind, ...] = Field(EVERY, min_length=1)
    per_hour: int = Field(
        20,
        ge=1,
        le=1000,
        description="messages in an hour, without stops and prompts; what comes beyond them is one digest",
    )


class Mail(_Target):
    """A target of kind mail: an SMTP server and the people that get its messages."""

    kind: Literal["smtp"]
    host: str = Field(min_length=1)
    port: int = Field(587, ge=1, le=65535)
    security: Literal["starttls", "tls", "none"] = "starttls"
    user: str | None = None
    password_file: Path | None = None
    sender: Address
    to: tuple[Address, ...] = Field(min_length=1, max_length=50)


class Webhook(_Target):
    """An address that takes messages as JSON; with a secret each carries an HMAC-SHA256 of its body."""

    kind: Literal["webhook"]
    url: str = Field(pattern=r"^https?://\S+$")
    secret_file: Path | None = None


class Targets(BaseModel):
    """The whole file of `BENCH_NOTIFY`: `[[target]]` tables, and the address under which people reach the pages."""

    model_config = ConfigDict(extra="forbid", frozen=True)

    pages: str = Field("", pattern=r"^(|https?://\S+)$", description="put before the paths of pages in messages")
    target: tuple[Annotated[Mail | Webhook, Field(discriminator="kind")], ...] = Field(min_length=1, max_length=20)


def read_targets(file: Path) -> Targets:
    """Return the targets that the file of `BENCH_NOTIFY` lists, checked. Raises `Misconfigured` naming the field."""
    try:
        found = Targets.model_validate(tomllib.loads(file.read_text(encoding="utf-8")))
    except (OSError, UnicodeDecodeError, tomllib.TOMLDecodeError) as error:
        raise Misconfigured(f"BENCH_NOTIFY {file} cannot be read: {error}") from error
    except ValidationError as error:
        first = error.errors()[0]
        place = ".".join(str(part) for part in first["loc"])
        raise Misconfigured(f"BENCH_NOTIFY {file}: {place}: {first['msg']}") from error
    names = [target.name for target in found.target]
    if len(set(names)) != len(names):
        raise Misconfigured(f"BENCH_NOTIFY {file}: target.name: each once, given {', '.join(names)}")
    for target in found.target:
        secret(target.password_file if isinstance(target, Mail) else target.secret_file)
    return found


def secret(file: Path | None) -> str | None:
    """Read the one line of a secret's file; None where none is named. Raises `Misconfigured`."""
    if file is None:
        return None
    try:
        text = file.read_text(encoding="utf-8").strip()
    except (OSError, UnicodeDecodeError) as error:
        raise Misconfigured(f"{file} of BENCH_NOTIFY cannot be read: {error}") from error
    if not text:
        raise Misconfigured(f"{file} of BENCH_NOTIFY is empty")
    return text
