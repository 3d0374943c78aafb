"""Routes of the pages of manual mode and of mountings; both are made by scripts over the public API."""

from fastapi import Request
from fastapi.responses import HTMLResponse

from bench_service.pages.rendering import service_of, templates
from bench_service.routing import Routes

router = Routes(include_in_schema=False, default_response_class=HTMLResponse)


@router.get("/benches/{bench_id}/manual")
def manual_page(bench_id: str, request: Request) -> HTMLResponse:
    """Return the HTML page where an operator commands an idle bench by hand; the limits stand at each demand."""
    service = service_of(request)
    description = service.benches.description(bench_id)
    units = [unit.serial for unit in service.benches.mounted(bench_id)]
    return templates.TemplateResponse(request, "manual.html", {"bench": description, "units": units})


@router.get("/mountings")
def mountings_page(request: Request) -> HTMLResponse:
    """Return the HTML page of mountings: which unit is on which plate, a form for a new one, and how well they
    repeat.
    """
    service = service_of(request)
    units = service.stores.units.serials()
    context = {"benches": service.benches.ids(), "units": units}
    return templates.TemplateResponse(request, "mountings.html", context)
