"""Findings of the inspection are in the result's warnings: in the document, on its page, and on the command line."""

import json
from pathlib import Path

import numpy as np
import pytest

from bench_service.cli.asking.client import connect
from bench_service.cli.commands import run_command_line
from bench_service.settings import Settings
from tests.service.client import Client

DESCRIBED = {
    "unit": "SENT-1",
    "rate_hz": 100.0,
    "channels": [
        {"name": f"gyro_{axis}", "quantity": "angular_rate", "unit": "count", "column": axis} for axis in "xyz"
    ],
}


def test_a_finding_reaches_document_page_and_command_line(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    samples = np.rint(np.random.default_rng(3).normal(0.0, 40.0, (20_000, 3))).astype(int)
    samples[4000:4015, 1] = samples[4000, 1]
    table = "x,y,z\n" + "\n".join(",".join(map(str, row)) for row in samples.tolist()) + "\n"
    settings = Settings(database_url=f"sqlite:///{tmp_path / 'bench.sqlite'}")
    with connect(settings, None, drive=False) as http:
        client = Client(http)
        recording = client.import_files(DESCRIBED, table.encode()).json()["id"]
        gyros = {"channels": ["gyro_x", "gyro_y"]}
        asked = {"allan_deviation": gyros, "noise_analysis": {"wavelet": "none"}, "kalman_calibration": gyros}
        for method, parameters in asked.items():
            answer = client.analyse(method, recordings=[recording], parameters=parameters)
            assert answer.status_code == 201, answer.text
            (warning,) = (w for w in answer.json()["document"]["warnings"] if "stands still" in w)
            assert "channel gyro_y stands still once while others move, 14 of 20000 samples in all" in warning
            assert "from sample 4001 (40.01 s)" in warning
            page = http.get(f"/results/{answer.json()['id']}").text
            assert "channel gyro_y stands still once while others move" in page
    code = run_command_line(settings, ["analyse", "allan_deviation", "--recording", recording, "--set", "points=10"])
    printed = capsys.readouterr().out
    assert "warning: channel gyro_y stands still once while others move" in " ".join(printed.split())
    assert code == 0
    code = run_command_line(
        settings, ["analyse", "allan_deviation", "--recording", recording, "--set", "start_s=50", "--json"]
    )
    assert json.loads(capsys.readouterr().out)["document"]["warnings"] == []
