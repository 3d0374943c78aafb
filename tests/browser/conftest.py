"""A real Chromium on a real service: every page is watched for errors and for requests that leave the machine."""

import re
import socket
from collections.abc import Callable, Generator, Iterator
from pathlib import Path
from urllib.parse import urlsplit

import pytest
from playwright.sync_api import Browser, BrowserContext, ConsoleMessage, Page, Request, expect, sync_playwright

from tests.browser.chromium import found
from tests.end_to_end.bench_process import BenchProcess

expect.set_options(timeout=20_000)  # of what is only waited for, on a busy machine; answers in time say their own
CHROMIUM_ARGUMENTS = ("--no-sandbox", "--disable-dev-shm-usage")
AWAY = re.compile(
    r"ERR_CONNECTION_REFUSED|ERR_CONNECTION_RESET|ERR_EMPTY_RESPONSE|ERR_INCOMPLETE_CHUNKED|status of (4|5)"
)
"""Lines that Chromium itself writes where a test kills the service, or has a request refused."""


class Watched:
    """A browser window, and what its pages complained about."""

    def __init__(self, context: BrowserContext, address: str) -> None:
        self.context = context
        self.address = address
        self.errors: list[str] = []
        self.expected: re.Pattern[str] | None = None
        context.on("page", self._watch)
        context.on("request", self._asked)

    def _watch(self, page: Page) -> None:
        page.on("console", self._said)
        page.on("pageerror", lambda error: self.errors.append(f"{page.url}: {error}"))

    def _said(self, message: ConsoleMessage) -> None:
        if message.type in ("error", "warning"):
            self.errors.append(f"{message.page.url if message.page else ''}: {message.text}")

    def _asked(self, request: Request) -> None:
        host = urlsplit(request.url).hostname
        if host not in (None, "127.0.0.1") and not request.url.startswith(("data:", "blob:")):
            self.errors.append(f"a request left the machine: {request.url}")

    def open(self, path: str = "/", ready: bool = True) -> Page:
        page = self.context.new_page()
        page.goto(self.address + path)
        if ready:
            page.wait_for_selector("html[data-ready]")
        return page

    def complaints(self) -> list[str]:
        return [line for line in self.errors if self.expected is None or not self.expected.search(line)]


@pytest.fixture(scope="session")
def chromium() -> Generator[Browser]:
    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=found(), args=list(CHROMIUM_ARGUMENTS))
        yield browser
        browser.close()


@pytest.fixture
def window(chromium: Browser, service: BenchProcess) -> Iterator[Watched]:
    """A fresh browser profile on the module's service; nothing may be complained about at the end."""
    watched = Watched(chromium.new_context(viewport={"width": 1280, "height": 900}), address(service))
    watched.context.set_default_timeout(15_000)
    yield watched
    watched.context.close()
    assert watched.complaints() == []


def address(service: BenchProcess) -> str:
    return str(service.client.base_url).rstrip("/")


def process(folder: Path, **settings: str) -> BenchProcess:
    """A service in a process of its own, on a database of its own."""
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        port: int = probe.getsockname()[1]
    return BenchProcess(f"sqlite:///{folder / 'bench.sqlite'}", port, folder, **settings)


@pytest.fixture(scope="module")
def settings() -> dict[str, str]:
    """Settings of the module's service; a module overrides this."""
    return {}


@pytest.fixture(scope="module")
def service(tmp_path_factory: pytest.TempPathFactory, settings: dict[str, str]) -> Generator[BenchProcess]:
    made = process(tmp_path_factory.mktemp("browser"), **settings)
    made.start()
    yield made
    made.end()


@pytest.fixture
def expect_absence(window: Watched) -> Callable[[], None]:
    """Allows the lines that Chromium writes about a service that is away."""

    def allow() -> None:
        window.expected = AWAY

    return allow
