"""Routes that are loaded while the server answers: liveness at once, everything else when they are there."""

import asyncio
from threading import Event

import httpx
import pytest
from fastapi import FastAPI

from bench_service.api.http.late_routes import LateRoutes, WaitForRoutes
from bench_service.routing import Routes

EARLY, LATE = Routes(), Routes(prefix="/api")


@EARLY.get("/healthz")
async def alive() -> str:
    return "alive"


@LATE.get("/noun")
async def noun() -> str:
    return "noun"


def application(late: LateRoutes) -> FastAPI:
    app = FastAPI()
    EARLY.add_to(app.router)
    app.add_middleware(WaitForRoutes, late=late)
    return app


def client_of(app: FastAPI) -> httpx.AsyncClient:
    return httpx.AsyncClient(transport=httpx.ASGITransport(app), base_url="http://bench")


def test_liveness_is_answered_at_once_and_the_rest_once_it_is_loaded() -> None:
    late, may_go_on = LateRoutes(lambda: pytest.fail("it loads")), Event()
    app = application(late)

    def load() -> None:
        may_go_on.wait()
        LATE.add_to(app.router)

    async def ask() -> None:
        async with client_of(app) as client:
            late.begin(load)
            waiting = asyncio.create_task(client.get("/api/noun"))
            left = asyncio.create_task(client.get("/api/noun"))
            assert (await client.get("/healthz")).json() == "alive"
            await asyncio.wait([waiting, left], timeout=0.05)
            assert not waiting.done()
            left.cancel()  # a client that leaves takes the loading from nobody
            may_go_on.set()
            assert (await waiting).json() == "noun"
            assert (await client.get("/api/unknown")).status_code == 404

    asyncio.run(ask())
    assert late.done
    assert late.failure() is None


def test_routes_that_cannot_be_loaded_are_told_to_whoever_waits_and_end_the_server() -> None:
    ended = Event()
    late = LateRoutes(ended.set)
    app = application(late)

    def load() -> None:
        raise ModuleNotFoundError("bench_service.api.gone")

    async def ask() -> None:
        async with client_of(app) as client:
            late.begin(load)
            with pytest.raises(ModuleNotFoundError, match="gone"):
                await client.get("/api/noun")
            assert (await client.get("/healthz")).status_code == 200

    asyncio.run(ask())
    assert ended.wait(10)
    assert isinstance(late.failure(), ModuleNotFoundError)
    with pytest.raises(ModuleNotFoundError):
        late.require()
