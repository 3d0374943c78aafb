"""Pictures of every page for the documents, on a service of their own: `make screenshots`. Left out otherwise."""

import io
from pathlib import Path
from typing import Any

import pytest
from PIL import Image
from playwright.sync_api import Browser, Page, expect

from tests.browser.conftest import address
from tests.end_to_end.bench_process import BenchProcess
from tests.kit.waiting import ended

WIDTH, HEIGHT = 1100, 760
QUALITY = 55
LARGEST = 1_500_000
"""Size of all pictures together [bytes]."""


pytestmark = pytest.mark.timeout(600)


@pytest.fixture(scope="module")
def folder(request: pytest.FixtureRequest) -> Path:
    given: str | None = request.config.getoption("--pictures")
    if given is None:
        pytest.skip("pictures are made by `make screenshots`")
    Path(given).mkdir(parents=True, exist_ok=True)
    return Path(given)


def taken(page: Page, folder: Path, name: str) -> None:
    """Keep a picture of what a reader sees of the page, small enough to be committed."""
    page.wait_for_timeout(300)
    with Image.open(io.BytesIO(page.screenshot())) as picture:
        picture.save(folder / f"{name}.webp", quality=QUALITY, method=6)


def paths(service: BenchProcess) -> dict[str, str]:
    """One page of each kind, by the name of its picture."""
    http = service.client
    job = ended(service, service.submit(seed=7, parameters={}))
    failed = ended(service, service.submit(seed=8, parameters={"dwell_s": 5.0, "settle_s": 0.5}))
    recording = http.get("/api/v1/recordings", params={"job": job["id"]}).json()["items"][0]["id"]
    step = {"name": "calibrate", "procedure": "calibration_12_orientations"}
    verify = {"name": "verify", "procedure": "verification_9_orientations", "gates": [{"step": "calibrate"}]}
    campaign = {"name": "week", "title": "Calibrate, then verify", "steps": [step, verify]}
    assert http.post("/api/v1/campaigns", json=campaign).is_success
    run = http.post("/api/v1/campaigns/week/runs", json={"unit": "SIM-0001", "seed": 7}).json()["id"]
    schedule = {"cron": "0 1 * * 1", "time_zone": "Europe/Kyiv", "campaign": "week", "unit": "SIM-0001"}
    assert http.post("/api/v1/schedules", json=schedule).is_success
    ended_run = f"/api/v1/campaign-runs/{run}"
    while http.get(ended_run).json()["finished_at"] is None:
        ended(service, service.submit("no_operation"))
    return {
        "home": "/",
        "start": "/start?unit=SIM-0001&procedure=calibration_12_orientations",
        "jobs": "/jobs",
        "queue": "/queue",
        "units": "/units",
        "recordings": "/recordings",
        "campaigns": "/campaigns",
        "audit": "/audit",
        "accounts": "/accounts",
        "certificate": "/certificate",
        "job": job["page"],
        "result": f"/results/{job['result']}",
        "failed-result": f"/results/{failed['result']}",
        "unit": "/units/SIM-0001",
        "enter-calibration": "/units/SIM-0001/calibrations/new",
        "trend": "/units/SIM-0001/trend",
        "recording": f"/recordings/{recording}",
        "campaign-run": f"/campaign-runs/{run}",
        "stops": "/benches/sim/stops",
        "log-in": "/log-in",
        "error": "/jobs/none",
    }


def test_a_picture_of_every_page_is_made(chromium: Browser, service: BenchProcess, folder: Path) -> None:
    context = chromium.new_context(viewport={"width": WIDTH, "height": HEIGHT}, timezone_id="Europe/Kyiv")
    page = context.new_page()
    for name, path in paths(service).items():
        page.goto(address(service) + path)
        page.wait_for_selector("html[data-ready]")
        if name == "start":
            expect(page.locator("#preview")).to_contain_text("12 stations")
        if name == "campaigns":
            expect(page.get_by_role("button", name="New campaign")).to_be_visible()
        if name == "accounts":
            expect(page.locator("[data-approval]").first).to_be_visible()
        taken(page, folder, name)
    narrow = chromium.new_context(viewport={"width": 400, "height": 760}, color_scheme="dark").new_page()
    narrow.goto(address(service))
    narrow.wait_for_selector("html[data-ready]")
    taken(narrow, folder, "home-narrow-dark")
    assert sum(file.stat().st_size for file in folder.glob("*.webp")) < LARGEST


def test_pictures_of_a_running_job_and_of_its_stop_are_made(
    chromium: Browser, service: BenchProcess, folder: Path
) -> None:
    page = chromium.new_context(viewport={"width": WIDTH, "height": HEIGHT}, timezone_id="Europe/Kyiv").new_page()
    warm = {"dwell_s": 5.0, "settle_s": 0.5}  # the simulator is loaded: a loaded machine takes long for that
    ended(service, service.submit(parameters=warm, retries=3))
    job: Any = service.submit(parameters={"dwell_s": 10_000.0}, seed=7)
    page.goto(f"{address(service)}/jobs/{job}")
    expect(page.locator("#charts canvas").first).to_be_visible(timeout=60_000)
    page.wait_for_timeout(3_000)
    taken(page, folder, "job-running")
    expect(page.locator("#estimates .uplot").first).to_be_visible(timeout=240_000)
    expect(page.locator("#estimates")).to_contain_text("Uncertainty after each station", timeout=240_000)
    page.locator("#estimates").scroll_into_view_if_needed()
    page.locator("#estimates h2").evaluate("e => scrollTo(0, e.getBoundingClientRect().top + scrollY - 80)")
    taken(page, folder, "estimates")
    page.get_by_role("button", name="STOP sim").click()
    expect(page.locator("form.stop output")).to_contain_text("has arrived", timeout=10_000)
    page.goto(address(service))
    expect(page.locator("#alerts")).to_contain_text("is stopped")
    taken(page, folder, "stopped")
