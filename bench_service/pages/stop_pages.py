"""Routes of the stop: the plain form of every page, which needs no script, and the history of a bench's stops."""

from json import JSONDecodeError
from typing import Annotated, Any
from urllib.parse import quote

from fastapi import Form, Request
from fastapi.responses import HTMLResponse

from bench_service.pages.in_process import ask
from bench_service.pages.rendering import service_of, templates
from bench_service.routing import Routes

router = Routes(include_in_schema=False, default_response_class=HTMLResponse)


@router.post("/benches/{bench_id}/stop")
async def stop_by_form(
    bench_id: str,
    request: Request,
    reason: Annotated[str, Form(max_length=500)] = "",
    by: Annotated[str, Form(max_length=200)] = "",
) -> HTMLResponse:
    """Stop a bench from a page whose scripts do not run, and return a page that says whether the stop arrived and what
    is safe.
    """
    given = {"reason": reason or "stop pressed on a page without scripts", "by": by}
    sent = {name: value for name, value in given.items() if value}
    answer = await ask(request, "POST", f"/api/v1/benches/{quote(bench_id, safe='')}/stop", sent)
    try:
        said: dict[str, Any] = answer.json()
    except JSONDecodeError:
        said = {"detail": answer.reason_phrase}
    context = {"bench": bench_id, "arrived": answer.is_success, "said": said, "status": answer.status_code}
    return templates.TemplateResponse(request, "stop.html", context, status_code=200 if answer.is_success else 502)


@router.get("/benches/{bench_id}/stops")
def stops_page(bench_id: str, request: Request, after: str | None = None) -> HTMLResponse:
    """Return the HTML page of a bench's stops, newest first: each with author, reason, release and remark."""
    service = service_of(request)
    service.benches.description(bench_id)
    page = service.stores.benches.stops(bench_id, after=after)
    return templates.TemplateResponse(
        request, "stops.html", {"bench": bench_id, "stops": page.items, "next": page.next}
    )
