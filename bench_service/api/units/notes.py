"""Routes of remarks about a unit."""

from datetime import datetime
from typing import Annotated

from fastapi import Path
from pydantic import BaseModel, Field

from bench_service.api.http.dependencies import After, ClientName, IdempotencyKey, Limit, ProvenName, Service
from bench_service.api.http.errors import problems
from bench_service.api.http.fields import NAME, Request
from bench_service.mapping import copied
from bench_service.model.notes import UnitNote
from bench_service.model.records import Idempotency
from bench_service.routing import Routes
from bench_service.wall_clock import new_id, now
from procedures.core.unit import SERIAL

router = Routes(prefix="/api/v1/units/{serial}/notes", tags=["units"])
Serial = Annotated[str, Path(pattern=SERIAL)]


class UnitRemark(Request):
    """A remark of a person about a unit."""

    text: str = Field(min_length=1, max_length=2000, pattern=r"^[^\x00]*\S[^\x00]*$")
    by: Annotated[str, NAME] | None = Field(None, description="Author of the note; null: the client's name")


class UnitNoteView(BaseModel):
    """A stored remark about a unit."""

    id: str
    unit: str
    at: datetime
    by: str
    proven: bool = Field(description="Whether the person was authenticated; else the name was declared")
    text: str


class UnitNotePage(BaseModel):
    """One page of remarks about a unit, newest first."""

    items: list[UnitNoteView]
    next: str | None = Field(description="Cursor: pass it as `after` for the next page")


@router.get("", responses=problems(404))
def list_unit_notes(serial: str, service: Service, after: After = None, limit: Limit = 50) -> UnitNotePage:
    """List the remarks about a unit, newest first."""
    service.stores.units.unit(serial)
    page = service.stores.unit_notes.list(serial, after=after, limit=limit)
    return UnitNotePage(items=[copied(UnitNoteView, note) for note in page.items], next=page.next)


@router.post("", status_code=201, responses=problems(404, 409, 413, 507))
def add_unit_note(
    serial: Serial,
    body: UnitRemark,
    service: Service,
    client: ClientName,
    proven: ProvenName,
    key: IdempotencyKey = None,
) -> UnitNoteView:
    """Add a remark to a unit: it stays with the unit, with its author, and is never changed."""
    service.stores.units.unit(serial)
    note = UnitNote(new_id(), serial, now(), proven or body.by or client, proven is not None, body.text.strip())
    asked = Idempotency.of("unit-notes", key, [serial, body])
    return copied(UnitNoteView, service.stores.unit_notes.add(note, asked))
