"""Requests over HTTP: token, retries while a service is away, and refusals as exceptions.

What only reads is repeated, and what is sent with an idempotency key: such a create is made once however often it is
asked for. Everything else is sent once.
"""

import time
from collections.abc import Callable, Generator
from contextlib import contextmanager
from typing import Any
from uuid import uuid4

import httpx
from pydantic import ValidationError

from bench_client.refusals import BenchClientError, Refused, Unavailable
from bench_client.views import Problem

NOT_NOW = (502, 503, 504)
"""Status codes of a service that is not ready, and of a proxy whose service is away."""
FIRST_PAUSE_S, LONGEST_PAUSE_S = 0.1, 5.0
"""Pause before the first repetition, doubled from one to the next up to the longest [s]."""
READING = ("GET", "HEAD")
KEY = "Idempotency-Key"


class Transport:
    """Sends requests to one service, with its token, and retries those that may be repeated."""

    def __init__(self, client: httpx.Client, patience_s: float, pause: Callable[[float], None] = time.sleep) -> None:
        """`patience_s`: time for which the service may be away [s]; `pause` waits for a number of seconds."""
        self._client = client
        self._patience_s = patience_s
        self._pause = pause

    def get(self, path: str, **query: Any) -> Any:
        """Send a GET and return the JSON document of the answer. Raises `Refused`, `Unavailable`."""
        return self._json(self.send("GET", path, params=query))

    def post(self, path: str, key: str | None = None, once: bool = True, **options: Any) -> Any:
        """Send a POST and return the JSON document of the answer. `once`: with an idempotency key, a new one where none
        is given. Raises `Refused`, `Unavailable`.
        """
        headers = {KEY: key or str(uuid4())} if once or key else {}
        return self._json(self.send("POST", path, headers=headers, **options))

    def send(self, method: str, path: str, **options: Any) -> httpx.Response:
        """Send a request and return a good answer. Raises `Refused`, `Unavailable`."""
        begun_s, pause_s = time.monotonic(), FIRST_PAUSE_S
        repeatable = method in READING or KEY in options.get("headers", {})
        while True:
            answer, why = self._once(method, path, options)
            if answer is not None and answer.status_code not in NOT_NOW:
                return _good(answer)
            away_s = time.monotonic() - begun_s
            if not repeatable or away_s + pause_s > self._patience_s:
                if answer is not None and _is_problem(answer):
                    return _good(answer)
                raise Unavailable(f"{self._client.base_url} does not answer {method} {path}: {why}")
            _rewind(options)
            self._pause(max(pause_s, _asked_pause_s(answer)))
            pause_s = min(2.0 * pause_s, LONGEST_PAUSE_S)

    @contextmanager
    def stream(self, path: str, headers: dict[str, str] | None = None, **query: Any) -> Generator[httpx.Response]:
        """Open an answer that is read piece by piece. Raises `Refused`, `Unavailable`; a stream is not repeated."""
        try:
            with self._client.stream("GET", path, params=query, headers=headers) as answer:
                if not answer.is_success:
                    answer.read()
                    _good(answer)
                yield answer
        except httpx.TransportError as error:
            raise Unavailable(f"{self._client.base_url} does not answer GET {path}: {_text(error)}") from error

    def _once(self, method: str, path: str, options: dict[str, Any]) -> tuple[httpx.Response | None, str]:
        try:
            answer = self._client.request(method, path, **options)
        except httpx.TransportError as error:
            return None, _text(error)
        return answer, f"{answer.status_code} {answer.reason_phrase}"

    @staticmethod
    def _json(answer: httpx.Response) -> Any:
        try:
            return answer.json()
        except ValueError as error:
            raise BenchClientError(f"{answer.url} is not a bench service: {answer.text[:120]!r}") from error


def _good(answer: httpx.Response) -> httpx.Response:
    if answer.is_success:
        return answer
    try:
        problem = Problem.model_validate_json(answer.content)
    except ValidationError:
        problem = Problem(status=answer.status_code, detail=f"{answer.url} answered {answer.text[:120]!r}")
    raise Refused(problem)


def _is_problem(answer: httpx.Response) -> bool:
    return answer.headers.get("content-type", "").startswith("application/problem+json")


def _asked_pause_s(answer: httpx.Response | None) -> float:
    """Return the time that the service asks a client to wait [s]; 0 where it says none in seconds."""
    asked = "" if answer is None else answer.headers.get("retry-after", "")
    return float(asked) if asked.isdecimal() else 0.0


def _rewind(options: dict[str, Any]) -> None:
    """Set files back to their beginning, so that they are sent whole again."""
    for _, (_, file, *_) in options.get("files", ()):
        if hasattr(file, "seek"):
            file.seek(0)


def _text(error: Exception) -> str:
    return str(error) or type(error).__name__
