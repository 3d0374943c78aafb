"""Rights of a browser over our answers: no frame, no script or style in place, no other host; files that it keeps."""

import re
from collections.abc import Generator
from importlib.resources import files
from pathlib import Path
from typing import Any

import httpx
import pytest

from bench_service.api.http.headers import OWN_FILES_ONLY
from bench_service.bench.directory import BenchDirectory
from bench_service.pages import figures, images
from tests.kit.served import served
from tests.service.campaigns import add, named, start
from tests.service.client import FAST, Client
from tests.service.page import drawn, page

PAGES = Path(__file__).parents[2] / "bench_service" / "pages"
IN_PLACE = re.compile(
    r"<script(?![^>]*\ssrc=)|<style|<svg|<iframe|\son[a-z]+\s*=|\sstyle\s*=|javascript:|\|\s*safe", re.I
)


@pytest.fixture(scope="module")
def client(tmp_path_factory: pytest.TempPathFactory) -> Generator[Client]:
    with served(tmp_path_factory.mktemp("served")) as at, httpx.Client(base_url=at, timeout=60) as http:
        yield Client(http)


@pytest.fixture(scope="module")
def job(client: Client) -> dict[str, Any]:
    return client.wait(client.submit(parameters=FAST, seed=7)["id"])


@pytest.fixture(scope="module")
def paths(client: Client, job: dict[str, Any]) -> list[str]:
    """One page of each kind."""
    add(client, named("night", {}))
    run = start(client, "night", seed=1)
    client.http.post("/api/v1/benches/sim/stop", json={"reason": "smoke"})
    waiting = client.submit("no_operation")["id"]
    return [
        "/",
        f"/jobs/{job['id']}",
        f"/jobs/{waiting}",
        f"/results/{job['result']}",
        "/units/SIM-0001",
        "/units/SIM-0001/trend",
        "/benches/sim/stops",
        "/campaigns",
        f"/campaign-runs/{run['id']}",
    ]


@pytest.mark.parametrize("template", sorted((PAGES / "templates").glob("*.html")), ids=lambda path: path.name)
def test_no_template_has_a_script_a_style_or_a_handler_in_place(template: Path) -> None:
    assert IN_PLACE.findall(template.read_text()) == []


def test_what_is_looked_for_would_be_found() -> None:
    assert outside('<img src="//evil.example/a"><form class="x" action="https://evil.example/">') != []
    for text in ("<script>x</script>", "<p onclick='x'>", '<p style="x">', "<style>", "<svg>", "{{ x | safe }}"):
        assert IN_PLACE.search(text), text
    assert not IN_PLACE.search('<script src="/static/act.js" defer></script><p class="on">')


def outside(text: str) -> list[str]:
    """Every address that a browser would fetch by itself, or send a form to, and that is not ours."""
    found = re.findall(r"<(?:script|img|link|form|iframe)[^>]*\s(?:src|href|action)=\"([^\"]*)\"", text)
    return [address for address in found if not re.match(r"/[^/]", address)]


def test_every_page_is_framed_by_nobody_and_runs_our_files_alone(client: Client, paths: list[str]) -> None:
    for path in paths:
        answer = client.http.get(path)
        assert answer.headers["content-security-policy"] == OWN_FILES_ONLY, path
        assert "unsafe" not in OWN_FILES_ONLY
        assert "frame-ancestors 'none'" in OWN_FILES_ONLY
        page(client, path)
        assert IN_PLACE.findall(answer.text) == [], path
        assert outside(answer.text) == [], path
        for address in re.findall(r'(?:src|href)="(/static/[^"]*)"', answer.text):
            kept = client.http.get(address)
            assert kept.status_code == 200, address
            assert "immutable" in kept.headers["cache-control"]


def test_every_answer_has_the_headers(client: Client, job: dict[str, Any], monkeypatch: pytest.MonkeyPatch) -> None:
    answers = {
        200: client.http.get("/api/v1/jobs"),
        404: client.http.get("/api/v1/jobs/none"),
        405: client.http.delete("/api/v1/jobs"),
        403: client.http.post("/api/v1/jobs", headers={"Origin": "null"}),
        421: client.http.get("/", headers={"Host": "evil.example"}),
        422: client.http.post("/api/v1/jobs", json={}),
        400: client.http.get("/jobs/a%00b"),
    }

    def broken(_self: object) -> tuple[str, ...]:
        raise RuntimeError("a defect, for a test")

    with monkeypatch.context() as patch:
        patch.setattr(BenchDirectory, "ids", broken)
        answers[500] = httpx.get(str(client.http.base_url))  # after a defect the server closes the connection
    with client.http.stream("GET", f"/api/v1/jobs/{job['id']}/events") as stream:
        answers[0] = stream
    answers[1] = client.http.get("/metrics")
    answers[2] = client.http.get(f"/api/v1/recordings/{client.recordings(job['id'])[0]['id']}/data?format=csv")
    for status, answer in answers.items():
        assert answer.status_code == (200 if status < 100 else status)
        assert answer.headers["content-security-policy"] == OWN_FILES_ONLY, status
        assert answer.headers["x-frame-options"] == "DENY"
        assert answer.headers["x-content-type-options"] == "nosniff"
        assert answer.headers["referrer-policy"] == "same-origin"
        assert answer.headers["cross-origin-resource-policy"] == "same-origin"


def test_the_document_of_the_api_is_shown_without_any_other_host(client: Client) -> None:
    answer = client.http.get("/docs")
    assert answer.status_code == 200
    assert IN_PLACE.findall(answer.text) == []
    assert outside(answer.text) == []
    assert "//" not in answer.text.replace("<!doctype", "")
    policy = answer.headers["content-security-policy"]
    assert "script-src 'self';" in policy
    assert "frame-ancestors 'none'" in policy
    assert not re.search(r"https?:|\*", policy)
    shipped = files("fastapi_offline") / "static"
    for name in ("swagger-ui.css", "swagger-ui-bundle.js"):
        (address,) = re.findall(rf'"(/static/{re.escape(name)}\?v=[0-9a-f]+)"', answer.text)
        sent = client.http.get(address)
        assert sent.content == (shipped / name).read_bytes()
        assert sent.headers["content-type"].split(";")[0] == ("text/css" if name.endswith("css") else "text/javascript")
    script = client.http.get("/static/docs.js").text
    assert '"/openapi.json"' in script
    assert "validatorUrl: null" in script, "else the package asks a server of its own"
    assert client.http.get("/openapi.json").status_code == 200
    older = client.http.get("/redoc")
    assert (older.status_code, older.headers["location"]) == (308, "/docs")


def test_a_file_that_a_browser_has_is_not_sent_again(client: Client) -> None:
    first = client.http.get("/static/page.css")
    assert first.headers["cache-control"] == "private, no-cache", "without its version it may change"
    tag = first.headers["etag"]
    for given in (tag, f"W/{tag}", f'"x", {tag}', "*"):
        again = client.http.get("/static/page.css", headers={"If-None-Match": given})
        assert (again.status_code, again.content, again.headers["etag"]) == (304, b"", tag)
    assert client.http.get("/static/page.css", headers={"If-None-Match": '"x"'}).status_code == 200
    for name in ("none.js", "..%2Froutes.py", "%2Fetc%2Fpasswd", "rendering.py"):
        assert client.http.get(f"/static/{name}").status_code == 404


def test_a_figure_is_drawn_once_for_all_who_look(
    client: Client, job: dict[str, Any], monkeypatch: pytest.MonkeyPatch
) -> None:
    text = client.http.get(f"/results/{job['result']}").text
    assert drawn(client, text) >= 4
    address = re.findall(r'<img src="([^"]*)"', text)[0]
    first = client.http.get(address)
    assert first.headers["content-security-policy"].endswith("sandbox")
    monkeypatch.setattr(images, "SHELF", images.FigureShelf())  # as another process, or after many other pages
    figures.svg.cache_clear()
    again = client.http.get(address)
    assert (again.content, again.headers["etag"]) == (first.content, first.headers["etag"])
    with monkeypatch.context() as patch:
        patch.setattr(images, "svg", lambda _: pytest.fail("drawn although the browser has it"))
        kept = client.http.get(address, headers={"If-None-Match": first.headers["etag"]})
    assert kept.status_code == 304
    for wrong in ("0", "99", "-1"):
        assert client.http.get(f"/results/{job['result']}/figures/{wrong}.svg").status_code == 404
    assert client.http.get(f"/results/{job['result']}/figures/x.svg").status_code == 422
    assert client.http.get("/results/none/figures/1.svg").status_code == 404


def test_the_chart_of_a_trend_is_an_image_of_what_was_chosen(
    client: Client, job: dict[str, Any], monkeypatch: pytest.MonkeyPatch
) -> None:
    assert job["result"]
    text = client.http.get("/units/SIM-0001/trend").text
    assert drawn(client, text) == 1
    (address,) = (found.replace("&amp;", "&") for found in re.findall(r'<img src="([^"]*)"', text))
    first = client.http.get(address).text
    monkeypatch.setattr(images, "SHELF", images.FigureShelf())
    assert client.http.get(address).text == first
    other = client.http.get("/units/SIM-0001/trend.svg", params={"quantity": "none"})
    assert other.status_code in (404, 422), other.text
    assert client.http.get("/units/none/trend.svg").status_code == 404


def test_the_shelf_of_figures_is_bounded() -> None:
    from procedures.core.report import Figure, Series

    shelf = images.FigureShelf(most=3)
    made = [Figure(str(k), "x", "y", (Series("", (0.0,), (float(k),)),)) for k in range(5)]
    versions = [shelf.put(figure, "1") for figure in made]
    assert [shelf.get(version) for version in versions] == [None, None, *made[2:]]
    assert shelf.put(made[4], "1") == versions[4]
    assert shelf.put(made[4], "2") != versions[4], "other code may draw it otherwise"
    assert shelf.get(None) is None


def test_no_script_opens_what_takes_the_stop_away() -> None:
    """The browser's own boxes, modal dialogs, popovers and the full screen lie over all of a page, its stop too."""
    taking = re.compile(
        r"\.showModal\(|\.showPopover\(|\.requestFullscreen\(|(?<![\w.])(?:window\.)?(?:alert|confirm|prompt)\("
    )
    folder = files("bench_service.pages") / "static"
    scripts = [file for file in folder.iterdir() if file.name.endswith(".js")]
    assert scripts
    assert [file.name for file in scripts if taking.search(file.read_text())] == []
