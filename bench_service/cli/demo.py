"""The demonstration ``make run``: calibrate and verify the simulated unit through the service, as an operator would."""

from typing import TYPE_CHECKING, Any

from rich.console import Console
from rich.text import Text

from bench_service.cli.asking.client import RESULT, call
from bench_service.cli.asking.watching import JOB, exit_code, watch
from bench_service.cli.printing.check_tables import check_table
from bench_service.cli.printing.tables import coefficient_table

if TYPE_CHECKING:
    import httpx

PROCEDURES = ("calibration_12_orientations", "verification_9_orientations")


def demonstrate(client: "httpx.Client", unit: str, seed: int, console: Console) -> int:
    """Calibrate a unit, verify it after another power-up (the next seed), and print both; return the exit code of the
    worse verdict.
    """
    codes = [_one(client, procedure, unit, seed + k, console) for k, procedure in enumerate(PROCEDURES)]
    return max(codes)


def _one(client: "httpx.Client", procedure: str, unit: str, seed: int, console: Console) -> int:
    body: dict[str, Any] = {"procedure": procedure, "unit": unit, "seed": seed}
    job = watch(client, call(client, "POST", "/api/v1/jobs", JOB, json=body), console)
    if job["state"] != "succeeded":
        console.print(f"{job['state']}: {job['error']}", style="red", soft_wrap=True)
        return 2
    result = call(client, "GET", f"/api/v1/jobs/{job['id']}/result", RESULT)
    if procedure.startswith("calibration"):
        _show_coefficients(client, job, console)
    console.print(check_table(result["document"]))
    for warning in result["document"]["warnings"]:
        console.print(warning, style="yellow", soft_wrap=True)
    colour = {"pass": "green", "fail": "red"}.get(job["verdict"], "yellow")
    verdict = Text(str(job["verdict"]), style=f"bold {colour}")
    page = f", page {client.base_url}{job['page']}"
    console.print(Text.assemble(f"{procedure}: verdict ", verdict, page), soft_wrap=True)
    return exit_code(job["verdict"])


def _show_coefficients(client: "httpx.Client", job: dict[str, Any], console: Console) -> None:
    path = f"/api/v1/units/{job['unit']}/calibrations"
    newest = call(client, "GET", path, ("items",), params={"limit": 2})["items"]
    truth = call(client, "GET", f"/api/v1/jobs/{job['id']}/truth", ("triads",))["triads"]
    table, worst = coefficient_table([c["calibration"] for c in reversed(newest)], truth)
    console.print(table)
    console.print(f"Largest of 24 errors: {worst:.2f} of its own standard uncertainty")
