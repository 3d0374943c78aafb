"""A request that is at work when the server ends is answered in our words, and not cut off with a bare 500."""

import asyncio
import json
import socket
import threading
from collections.abc import AsyncIterator, Iterator

import httpx
import pytest
import uvicorn
from fastapi import FastAPI
from starlette.responses import StreamingResponse

from bench_service.api.http import endings, errors
from bench_service.wall_clock import pause


@pytest.fixture
def server() -> Iterator[tuple[uvicorn.Server, str, threading.Event]]:
    """A real server with one route that takes longer than the server waits at its end."""
    app, reached, free = FastAPI(), threading.Event(), threading.Event()
    errors.install(app)
    endings.install(app)

    @app.post("/slow")
    def slow() -> None:
        reached.set()
        free.wait(20)

    @app.get("/endless")
    async def endless() -> StreamingResponse:
        async def pieces() -> AsyncIterator[bytes]:
            while True:
                yield b"piece"
                reached.set()
                await asyncio.sleep(0.05)

        return StreamingResponse(pieces())

    with socket.socket() as listening:
        listening.bind(("127.0.0.1", 0))
        made = uvicorn.Server(uvicorn.Config(app, log_level="critical", timeout_graceful_shutdown=1))
        thread = threading.Thread(target=made.run, kwargs={"sockets": [listening]})
        thread.start()
        while not made.started:
            pause(0.01)
        yield made, f"http://127.0.0.1:{listening.getsockname()[1]}", reached
        free.set()
        made.should_exit = True
        thread.join()


def test_a_request_that_outlasts_the_server_is_told_to_come_again(
    server: tuple[uvicorn.Server, str, threading.Event],
) -> None:
    running, address, reached = server
    answers: list[httpx.Response] = []
    asking = threading.Thread(target=lambda: answers.append(httpx.post(f"{address}/slow", timeout=30)))
    asking.start()
    assert reached.wait(10)
    running.should_exit = True
    asking.join(20)
    (answer,) = answers
    assert answer.status_code == 503
    assert answer.headers["content-type"] == "application/problem+json"
    problem = json.loads(answer.text)
    assert problem["type"] == "/problems/Ending"
    assert "Idempotency-Key" in problem["detail"]


def test_a_stream_that_is_cut_does_not_look_whole(
    server: tuple[uvicorn.Server, str, threading.Event], caplog: pytest.LogCaptureFixture
) -> None:
    running, address, reached = server
    with httpx.stream("GET", f"{address}/endless", timeout=30) as answer:
        assert answer.status_code == 200
        assert reached.wait(10)
        running.should_exit = True
        with pytest.raises(httpx.RemoteProtocolError):
            answer.read()
    assert not any(record.exc_info for record in caplog.records)
