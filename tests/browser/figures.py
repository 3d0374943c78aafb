"""Figures of the console in a real Chromium, printed beside their limits: `python -m tests.browser.figures`.

Stop: press to the service's answer, with many pages open and a job at full speed. Paint: first paint of the home page
and of a large result. Charts: eight channels, ten updates a second, heap of the page after collection at the begin and
at the end. Stream: processor time of the service with a plain client reading the feed, and without, in turns.
"""

import argparse
import os
import tempfile
import threading
from pathlib import Path
from statistics import median, quantiles

import httpx
import psutil
from playwright.sync_api import Browser, Page, sync_playwright

from bench_service.wall_clock import monotonic_s, pause
from tests.browser.chromium import found
from tests.browser.conftest import CHROMIUM_ARGUMENTS, address, process
from tests.end_to_end.bench_process import BenchProcess
from tests.kit.waiting import ended

CHARTS = """async () => {
  const page = document.querySelector('script[src*="page.js"]').src;
  const { Strip } = await import(page.replace(/page\\.js.*$/, "charts.js"));
  const charts = [...Array(8).keys()].map((k) => new Strip(`channel ${k}`, "rad/s", [`c${k}`]));
  document.getElementById("main").append(...charts.map((chart) => chart.element));
  window.sent = 0;
  setInterval(() => {
    window.sent += 1;
    for (const chart of charts) { chart.add(window.sent / 10, [Math.sin(window.sent / 20)]); chart.draw(); }
  }, 100);
}"""
REAL_TIME_FACTOR = "10"
"""Pace of the job whose page is watched for long: its events and live states come as on a bench."""


def load() -> str:
    return "load average " + " ".join(f"{value:.1f}" for value in os.getloadavg())


def figure(text: str, value: float, limit: float, unit: str) -> bool:
    print(f"{text}: {value:.3g} {unit} (limit {limit:g}) {'kept' if value <= limit else 'EXCEEDED'}; {load()}")
    return value <= limit


def stop_answer(browser: Browser, service: BenchProcess, pages: int, presses: int) -> bool:
    context = browser.new_context()
    job = service.submit("static_run", parameters={"launches": 1, "duration_s": 864_000.0})
    opened = [context.new_page() for _ in range(pages)]
    for number, page in enumerate(opened):
        page.goto(address(service) + ("/" if number % 2 else f"/jobs/{job}"))
    took: list[float] = []
    for press in range(presses):
        page = opened[press * len(opened) // presses]
        page.bring_to_front()
        with page.expect_response("**/api/v1/benches/sim/stop") as answered:
            page.locator("form.stop button").click()
        took.append(answered.value.request.timing["responseStart"])
        for stop in service.client.get("/api/v1/benches/sim").json()["stops"]:
            path = f"/api/v1/benches/sim/stops/{stop['id']}/release"
            while not service.client.post(path, json={"by": "figures", "remark": "again"}).is_success:
                pause(0.1)
        service.submit("static_run", parameters={"launches": 1, "duration_s": 864_000.0})
        pause(0.5)
    context.close()
    for state in ("queued", "running"):
        for one in service.client.get("/api/v1/jobs", params={"state": state}).json()["items"]:
            service.client.post(f"/api/v1/jobs/{one['id']}/cancel")
    p95 = quantiles(took, n=20)[-1]
    return figure(f"stop, {pages} pages open, {presses} presses, p95 of press to answer", p95, 150.0, "ms")


def first_paint(browser: Browser, service: BenchProcess, name: str, path: str, limit_s: float) -> bool:
    took: list[float] = []
    for _ in range(7):
        context = browser.new_context()
        page = context.new_page()
        page.goto(address(service) + path)
        page.wait_for_function("performance.getEntriesByName('first-contentful-paint').length > 0")
        took.append(page.evaluate("performance.getEntriesByName('first-contentful-paint')[0].startTime") / 1000.0)
        context.close()
    return figure(f"first paint of {name}, median of 7 fresh profiles", median(took), limit_s, "s")


def heap(page: Page) -> float:
    session = page.context.new_cdp_session(page)
    session.send("HeapProfiler.collectGarbage")
    return float(session.send("Runtime.getHeapUsage")["usedSize"]) / 1e6


def charts(browser: Browser, folder: Path, minutes: float) -> bool:
    """Watch the page of a running job, with eight more charts on it that get ten values a second each."""
    service = process(folder, real_time_factor=REAL_TIME_FACTOR)
    service.start()
    try:
        return _charts(browser, service, minutes)
    finally:
        service.end()


def _charts(browser: Browser, service: BenchProcess, minutes: float) -> bool:
    job = service.submit(parameters={"dwell_s": 86_400.0, "settle_s": 0.5})
    page = browser.new_context().new_page()
    wrong: list[str] = []
    page.on("pageerror", lambda error: wrong.append(str(error)))
    page.goto(f"{address(service)}/jobs/{job}")
    page.wait_for_selector("#charts canvas", timeout=60_000)
    page.evaluate(CHARTS)
    pause(150.0)  # until old points are merged for the first time: then the page is at its size
    assert page.locator("main > .chart canvas").count() == 8, "the charts are not drawn"
    before, sent = heap(page), page.evaluate("sent")
    begun = monotonic_s()
    pause(60.0 * minutes)
    after, rate = heap(page), (page.evaluate("sent") - sent) / (monotonic_s() - begun)
    page.context.close()
    assert not wrong, wrong[:3]
    print(f"charts: 8 channels, {rate:.1f} updates/s over {minutes:g} min, heap {before:.1f} -> {after:.1f} MB")
    return figure("charts, growth of the heap", 100.0 * abs(after / before - 1.0), 10.0, "%")


def stream(service: BenchProcess, turn_s: float, turns: int) -> bool:
    server = psutil.Process(service.process.pid)

    def used() -> float:
        begun, at_s = sum(server.cpu_times()[:2]), monotonic_s()
        pause(turn_s)
        return (sum(server.cpu_times()[:2]) - begun) / (monotonic_s() - at_s)

    extra: list[float] = []
    for _ in range(turns):
        alone = used()
        ending = threading.Event()

        def listen(ending: threading.Event = ending) -> None:
            with httpx.stream("GET", address(service) + "/api/v1/feed", timeout=30) as answer:
                for _ in answer.iter_raw():
                    if ending.is_set():
                        return

        listener = threading.Thread(target=listen)
        listener.start()
        pause(1.0)
        extra.append(used() - alone)
        ending.set()
        listener.join()
    return figure(
        f"stream, idle bench, median of {turns} turns of {turn_s:g} s", 100.0 * median(extra), 5.0, "% of a core"
    )


def main() -> None:
    """Measure all figures."""
    parser = argparse.ArgumentParser()
    parser.add_argument("--pages", type=int, default=50)
    parser.add_argument("--presses", type=int, default=20)
    parser.add_argument("--minutes", type=float, default=20.0)
    given = parser.parse_args()
    with (
        tempfile.TemporaryDirectory() as folder,
        tempfile.TemporaryDirectory() as apart,
        sync_playwright() as playwright,
    ):
        service = process(Path(folder))
        service.start()
        browser = playwright.chromium.launch(executable_path=found(), args=list(CHROMIUM_ARGUMENTS))
        try:
            job = ended(service, service.submit(seed=7, parameters={}))
            kept = first_paint(browser, service, "the home page", "/", 0.3)
            kept &= first_paint(browser, service, "a calibration's result", f"/results/{job['result']}", 1.0)
            kept &= stream(service, 8.0, 3)
            kept &= stop_answer(browser, service, given.pages, given.presses)
            kept &= charts(browser, Path(apart), given.minutes)
        finally:
            browser.close()
            service.end()
    raise SystemExit(0 if kept else 1)


if __name__ == "__main__":
    main()
