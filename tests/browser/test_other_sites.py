"""Pages of another site in a browser whose user is logged in: framing, forms, fetches, a name that resolves to us.

The other site is a server of the test's own under `evil.localhost`, which a browser resolves to this machine and takes
for another site than 127.0.0.1; its pages come from a loopback address too, so nothing but the service refuses them.
"""

import re
from collections.abc import Generator
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from threading import Thread
from typing import Any

import pytest
from playwright.sync_api import Browser, BrowserContext, Page, Response

from tests.browser.accounts import PASSWORD, with_account
from tests.browser.conftest import address
from tests.end_to_end.bench_process import BenchProcess

FRAMED = ("/", "/log-in", "/benches/sim/stops", "/recordings", "/docs")
IMPORT = '{"unit": "EVIL-1", "time_column": "t", "channels": [{"name": "gyro_x", "column": "x", '
IMPORT += '"quantity": "angular_rate", "unit": "deg/s"}]}'


@pytest.fixture(scope="module")
def service(tmp_path_factory: pytest.TempPathFactory) -> Generator[BenchProcess]:
    with with_account(tmp_path_factory.mktemp("accounts")) as made:
        yield made


class Evil:
    """The other site: it serves one page, whatever is asked for."""

    def __init__(self) -> None:
        self.page = ""
        site = self

        class Handler(BaseHTTPRequestHandler):
            def do_GET(self) -> None:
                body = f"<!doctype html><title>evil</title><body>{site.page}</body>".encode()
                self.send_response(200)
                self.send_header("Content-Type", "text/html; charset=utf-8")
                self.end_headers()
                self.wfile.write(body)

            def log_message(self, *_: Any) -> None: ...

        self.server = ThreadingHTTPServer(("127.0.0.1", 0), Handler)
        self.port = self.server.server_address[1]

    def address(self, host: str = "evil.localhost") -> str:
        return f"http://{host}:{self.port}/"


@pytest.fixture(scope="module")
def evil() -> Generator[Evil]:
    made = Evil()
    thread = Thread(target=made.server.serve_forever, daemon=True)
    thread.start()
    yield made
    made.server.shutdown()
    made.server.server_close()
    thread.join()


@pytest.fixture
def context(chromium: Browser, service: BenchProcess) -> Generator[BrowserContext]:
    """A browser profile whose user is logged in."""
    made = chromium.new_context()
    made.set_default_timeout(15_000)
    page = made.new_page()
    page.goto(f"{address(service)}/log-in")
    log_in(page)
    page.close()
    yield made
    made.close()


def log_in(page: Page) -> None:
    page.get_by_label("Name", exact=True).fill("ada")
    page.get_by_label("Password").fill(PASSWORD)
    page.locator("#log-in button").click()
    page.wait_for_url(lambda url: "/log-in" not in url)


def session(service: BenchProcess, context: BrowserContext) -> dict[str, Any]:
    return context.request.get(f"{address(service)}/api/v1/session").json()


def state(service: BenchProcess, context: BrowserContext) -> tuple[Any, ...]:
    """Everything that the other site tries to change."""
    asked = ("benches/sim/stops", "recordings", "jobs", "accounts", "tokens")
    found = {name: context.request.get(f"{address(service)}/api/v1/{name}").json() for name in asked}
    stops = [(stop["id"], stop["reason"], stop["released_at"]) for stop in found["benches/sim/stops"]["items"]]
    lists = ([one["id"] for one in found[name]["items"]] for name in asked[1:3])
    return (stops, *lists, *([one["name"] for one in found[name]] for name in asked[3:]))


@pytest.mark.parametrize("tag", ["iframe src", "object data", "embed src"])
def test_no_page_is_framed_by_another_site(
    context: BrowserContext, service: BenchProcess, evil: Evil, tag: str
) -> None:
    """A framed page with the stop or the release under the pointer would be pressed for another reason."""
    for path in FRAMED:
        evil.page = f'<{tag}="{address(service)}{path}" width="600" height="400"></{tag.split()[0]}>'
        page = context.new_page()
        with page.expect_response(lambda answer, path=path: answer.url == address(service) + path) as asked:
            page.goto(evil.address())
        page.wait_for_timeout(200)
        assert asked.value.status == 403, "refused before it is made"
        assert "frame-ancestors 'none'" in asked.value.headers["content-security-policy"], "and else not shown"
        shown = [frame for frame in page.frames[1:] if frame.evaluate("document.body.innerText.includes('STOP')")]
        assert shown == [], path
        page.close()


@pytest.mark.parametrize("path", FRAMED)
def test_a_browser_shows_no_page_in_a_frame_even_where_it_was_answered(
    context: BrowserContext, service: BenchProcess, evil: Evil, path: str
) -> None:
    """The request is changed on its way so that the service answers it: what is left is the header of its answer."""
    honest = context.request.get(address(service) + path)
    assert honest.status == 200
    evil.page = f'<iframe src="{address(service)}{path}"></iframe>'
    page = context.new_page()
    said: list[str] = []
    page.on("console", lambda message: said.append(message.text))
    page.route(f"{address(service)}{path}", lambda route: route.fulfill(response=honest))
    page.goto(evil.address())
    page.wait_for_timeout(200)
    assert any("frame-ancestors" in line for line in said), said
    assert not any(frame.evaluate("document.body.innerText.includes('STOP')") for frame in page.frames[1:])
    page.close()


def submitted(page: Page, evil: Evil, form: str) -> Response:
    """The answer to a form of the other site that its page submits by itself."""
    evil.page = form + "<script>document.forms[0].submit()</script>"
    with page.expect_response(lambda answer: answer.request.method == "POST") as sent:
        page.goto(evil.address(), wait_until="commit")
    return sent.value


def test_no_form_of_another_site_does_anything(context: BrowserContext, service: BenchProcess, evil: Evil) -> None:
    own = address(service)
    csrf = session(service, context)["csrf"]
    made = context.request.post(
        f"{own}/api/v1/benches/sim/stop", data={"reason": "hands in the chamber"}, headers={"X-CSRF-Token": csrf}
    )
    assert made.status == 202, made.text()
    service.until(lambda: bool(service_stops(service, context)), 20)
    before = state(service, context)
    multipart = f'method="post" enctype="multipart/form-data" action="{own}/api/v1/recordings"'
    as_json = '<input name=\'{"by":"evil","remark":"\' value=\'go on"}\'>'
    stop_id = made.json()["stop"]
    forms = (
        f'<form method="post" action="{own}/benches/sim/stop"><input name="reason" value="evil"></form>',
        f'<form method="post" action="{own}/api/v1/benches/sim/stop"></form>',
        f'<form method="post" action="{own}/api/v1/benches/sim/release"></form>',
        f'<form method="post" enctype="text/plain" action="{own}/api/v1/benches/sim/stops/{stop_id}/release">'
        f"{as_json}</form>",
        f"<form {multipart}><textarea name='description'>{IMPORT}</textarea></form>",
        f'<form method="post" action="{own}/api/v1/session"></form>',
    )
    for form in forms:
        page = context.new_page()
        answer = submitted(page, evil, form)
        assert answer.status == 403, (form, answer.status)
        page.close()
    assert state(service, context) == before
    released = context.request.post(
        f"{own}/api/v1/benches/sim/stops/{stop_id}/release",
        data={"remark": "looked at"},
        headers={"X-CSRF-Token": csrf},
    )
    assert released.status == 200, released.text()


def service_stops(service: BenchProcess, context: BrowserContext) -> list[Any]:
    return context.request.get(f"{address(service)}/api/v1/benches/sim").json()["stops"]


FETCHES = """async ([own, body]) => {
    const answers = [];
    for (const [path, options] of [
        ["/api/v1/benches/sim/stop", {method: "POST", mode: "no-cors"}],
        ["/api/v1/jobs", {method: "POST", mode: "cors", body, headers: {"Content-Type": "application/json"}}],
        ["/api/v1/jobs", {method: "POST", mode: "no-cors", body}],
        ["/api/v1/jobs", {mode: "cors"}],
        ["/api/v1/session", {mode: "cors"}],
    ]) {
        try {
            const answer = await fetch(own + path, {...options, credentials: "include"});
            answers.push([path, answer.type, answer.type === "opaque" ? "" : await answer.text()]);
        } catch (error) { answers.push([path, "refused", ""]); }
    }
    const opened = window.open(own + "/");
    await new Promise((done) => setTimeout(done, 1000));
    let reached = "nothing";
    try { reached = opened.document.title; } catch (error) { reached = "nothing"; }
    answers.push(["window", opened === null || opened.closed ? "cut" : "open", reached === "nothing" ? "" : reached]);
    return answers;
}"""


def test_no_script_of_another_site_reads_or_changes_anything(
    context: BrowserContext, service: BenchProcess, evil: Evil
) -> None:
    before = state(service, context)
    evil.page = "the other site"
    page = context.new_page()
    page.goto(evil.address())
    body = '{"procedure": "no_operation", "unit": "SIM-0001"}'
    answers = page.evaluate(FETCHES, [address(service), body])
    assert [text for _, _, text in answers if text] == [], "something was read"
    assert {kind for _, kind, _ in answers} <= {"refused", "opaque", "cut", "open"}
    assert state(service, context) == before


def test_a_change_by_the_cookie_alone_is_refused(context: BrowserContext, service: BenchProcess) -> None:
    """As a script would send it that came into a page of another origin of the same site: another port, say."""
    page = context.new_page()
    page.goto(f"{address(service)}/")
    asked = """async (csrf) => (await fetch("/api/v1/jobs", {method: "POST", headers: {
        "Content-Type": "application/json", ...(csrf === null ? {} : {"X-CSRF-Token": csrf})},
        body: '{"procedure": "no_operation", "unit": "SIM-0001"}'})).status"""
    csrf = session(service, context)["csrf"]
    assert page.evaluate(asked, None) == 403
    assert page.evaluate(asked, "0" * len(csrf)) == 403
    assert page.evaluate(asked, csrf) == 202
    assert page.evaluate("document.cookie") == "", "scripts do not see the session"


def test_a_name_of_another_site_that_resolves_to_us_is_refused(context: BrowserContext, service: BenchProcess) -> None:
    port = address(service).rpartition(":")[2]
    page = context.new_page()
    answer = page.goto(f"http://evil.localhost:{port}/")
    assert answer is not None
    assert answer.status == 421
    read = "async () => { const a = await fetch('/api/v1/jobs'); return [a.status, await a.text()]; }"
    status, text = page.evaluate(read)
    assert status == 421
    assert "items" not in text


def test_a_session_that_another_port_has_planted_is_not_used_after_the_log_in(
    chromium: Browser, service: BenchProcess, evil: Evil
) -> None:
    """Cookies know no ports: a page of 127.0.0.1 on another one may set ours. The log-in makes a new one."""
    planted = "an-attackers-session-that-is-known"
    with_plant = chromium.new_context()
    evil.page = f"<script>document.cookie = 'bench_session={planted}; path=/; SameSite=Lax'</script>"
    page = with_plant.new_page()
    page.goto(evil.address("127.0.0.1"))
    page.goto(f"{address(service)}/log-in")
    log_in(page)
    values = [cookie["value"] for cookie in with_plant.cookies() if "bench_session" in cookie["name"]]
    assert planted not in values
    assert re.match(r"/($|\?)|/[^l]", page.url.removeprefix(address(service)))
    with_plant.close()
    attacker = chromium.new_context()
    answer = attacker.request.get(f"{address(service)}/api/v1/jobs", headers={"Cookie": f"bench_session={planted}"})
    assert answer.status == 401
    attacker.close()
