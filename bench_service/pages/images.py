"""Figures as image files: a page names them, and a browser fetches them one by one and caches them.

A page has each figure at hand when it is made, and puts it aside for the request that follows. Where it is not there
any more (another process answers, many pages came between), the figure is made again from the stored result.
"""

import hashlib
from collections import OrderedDict
from threading import Lock

from fastapi import Request, Response

from bench_service.evidence.admission import Turns
from bench_service.model.errors import NotFound
from bench_service.pages.caching import kept
from bench_service.pages.figures import svg
from bench_service.pages.rendering import service_of
from bench_service.pages.trend_chart import TrendQuery, trend_of, wanted_trend
from bench_service.routing import Routes
from procedures.core.report import Figure, Report

router = Routes(include_in_schema=False)

POLICY = "default-src 'none'; style-src 'unsafe-inline'; frame-ancestors 'none'; sandbox"
"""Content-Security-Policy of a drawing: it has styles in place; opened alone it runs nothing."""
IMAGES = Turns("figures", at_once=4, waiting=400)
"""Images: one is drawn at a time, and a page of a static run asks for twenty at once."""
MOST = 200
"""Number of figures that are kept: those of about ten pages, as many as are kept drawn."""


class FigureShelf:
    """Cache of the figures of the latest pages, by version, for the requests of images that follow."""

    def __init__(self, most: int = MOST) -> None:
        self._figures: OrderedDict[str, Figure] = OrderedDict()
        self._most = most
        self._mutex = Lock()

    def put(self, figure: Figure, code_version: str) -> str:
        """Keep a figure for its request, and return its version, which changes with its content and with the code that
        draws it.
        """
        version = hashlib.sha256(f"{code_version}\n{figure!r}".encode()).hexdigest()[:16]
        with self._mutex:
            self._figures[version] = figure
            self._figures.move_to_end(version)
            while len(self._figures) > self._most:
                self._figures.popitem(last=False)
        return version

    def get(self, version: str | None) -> Figure | None:
        """Return the figure of a version; None where it is no longer kept."""
        with self._mutex:
            return None if version is None else self._figures.get(version)


SHELF = FigureShelf()


def report_figures(report: Report) -> list[Figure]:
    """Return the figures of a report, in order."""
    return [section for section in report.sections if isinstance(section, Figure)]


@router.get("/results/{result_id}/figures/{number}.svg")
async def result_figure(result_id: str, number: int, request: Request) -> Response:
    """Return the image of a figure of a result's report, by its number from 1; with `v`, the kept image of that
    version. Raises `NotFound`.
    """
    return await IMAGES.run(_result_figure, result_id, number, request)


def _result_figure(result_id: str, number: int, request: Request) -> Response:
    figure = SHELF.get(request.query_params.get("v"))
    if figure is None:
        service = service_of(request)
        figures = report_figures(service.catalogue.report(service.stores.results.get(result_id)))
        if not 1 <= number <= len(figures):
            raise NotFound("figure", f"{result_id}/{number}", f"the result has {len(figures)}")
        figure = figures[number - 1]
    return _drawn(request, figure)


@router.get("/units/{serial}/trend.svg")
async def trend_image(serial: str, request: Request, query: TrendQuery) -> Response:
    """Return the image of the chart of a quantity over a unit's results. Raises `NotFound`."""
    return await IMAGES.run(_trend_image, serial, request, query)


def _trend_image(serial: str, request: Request, query: TrendQuery) -> Response:
    figure = SHELF.get(request.query_params.get("v"))
    if figure is None:
        figure = trend_of(service_of(request), serial, wanted_trend(service_of(request), serial, query)).figure
    if figure is None:
        raise NotFound("figure", serial, "the unit has no result with that quantity")
    return _drawn(request, figure)


def _drawn(request: Request, figure: Figure) -> Response:
    version = SHELF.put(figure, service_of(request).code_version)
    return kept(request, version, "image/svg+xml", lambda: svg(figure), POLICY)
