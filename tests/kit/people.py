"""People and programs for tests: a served service with accounts, and clients that log in or send tokens."""

import socket
from collections.abc import Generator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import httpx
import pytest
from argon2 import PasswordHasher

from bench_service.access import passwords
from bench_service.cli.asking.client import connect
from bench_service.cli.processes.serving import serving
from bench_service.settings import Settings
from bench_service.wall_clock import monotonic_s, pause
from tests.kit.registered import register_bench

PASSWORD = "a horse and a stair"
CSRF = "X-CSRF-Token"
SEEN_S = 5.0
"""Longest time until a running service has seen what another process changed [s]: it looks every second."""


def free_port() -> int:
    """A loopback port that nobody listens on."""
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        return probe.getsockname()[1]


class House:
    """A service on a port, with a bench that nobody drives, and its owner's client."""

    def __init__(self, settings: Settings, owner: httpx.Client) -> None:
        self.settings = settings
        self.owner = owner
        self.url = f"http://127.0.0.1:{settings.port}"
        self._clients: list[httpx.Client] = []

    def client(self, **headers: str) -> httpx.Client:
        """A program on this host that says nothing about itself but these headers."""
        client = httpx.Client(base_url=self.url, headers=headers, timeout=60)
        self._clients.append(client)
        return client

    def close(self) -> None:
        """Close every client."""
        for client in self._clients:
            client.close()

    def add_account(self, name: str, role: str = "admin", **more: Any) -> None:
        """Add an account, and wait until the running service knows it."""
        body = {"name": name, "role": role, "password": PASSWORD, **more}
        answer = self.owner.post("/api/v1/accounts", json=body)
        assert answer.status_code == 201, answer.text
        deadline_s = monotonic_s() + SEEN_S
        with self.client() as http:
            while not http.get("/api/v1/session").json()["log_in_needed"]:
                assert monotonic_s() < deadline_s
                pause(0.02)

    def add_token(self, name: str, role: str, **more: Any) -> str:
        """Make a token; the running service looks for it when it comes."""
        answer = self.owner.post("/api/v1/tokens", json={"name": name, "role": role, **more})
        assert answer.status_code == 201, answer.text
        return answer.json()["token"]

    def program(self, name: str, role: str, **more: Any) -> httpx.Client:
        """A client with a token of its own."""
        return self.client(Authorization=f"Bearer {self.add_token(name, role, **more)}")

    def person(self, name: str, password: str = PASSWORD) -> httpx.Client:
        """A client that has logged in, as the pages of a browser do."""
        with self.client() as first:
            answer = first.post("/api/v1/session", json={"name": name, "password": password})
        assert answer.status_code == 201, answer.text
        http = self.client(**{CSRF: answer.json()["csrf"]})
        http.cookies.update(first.cookies)
        return http


@contextmanager
def cheap_passwords() -> Generator[None]:
    """Hash passwords with little memory and time, so that tests of other things do not wait for them."""
    with pytest.MonkeyPatch.context() as patch:
        hasher = PasswordHasher(time_cost=1, memory_cost=64, parallelism=1)
        patch.setattr(passwords, "_hasher", lambda: hasher)
        passwords._nobody.cache_clear()
        yield
    passwords._nobody.cache_clear()


@contextmanager
def house(folder: Path, **more: Any) -> Generator[House]:
    """Open a service without accounts; it drives nothing, and its bench is known."""
    settings = Settings(**{"database_url": f"sqlite:///{folder / 'bench.sqlite'}", "port": free_port(), **more})
    register_bench(settings)
    with cheap_passwords(), serving(settings, drive=False), connect(settings, None, drive=False) as owner:
        made = House(settings, owner)
        yield made
        made.close()
