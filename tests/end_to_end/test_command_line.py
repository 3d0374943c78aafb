"""The command line as an operating system process: what it prints, its exit codes, and how it ends."""

import json
import signal
import socket
from collections.abc import Generator
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest

from bench_service.bench.worker_time_limits import ENDING_S
from tests.end_to_end.bench_process import BenchProcess
from tests.kit.command_line import Command, command_here, command_in, one_line

pytestmark = pytest.mark.timeout(240)

FAST = ("--set", "dwell_s=5.0", "--set", "settle_s=0.5")


@pytest.fixture
def bench(tmp_path: Path) -> Command:
    """``bench`` as a process, with a database of this test's own."""
    return command_in(tmp_path)


@pytest.fixture
def bench_here(tmp_path: Path) -> Command:
    """The same in this process: for what a command says and how it is used, not how its process ends."""
    return command_here(tmp_path)


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Where the tests of one story meet."""
    return tmp_path_factory.mktemp("story")


@pytest.fixture(scope="module")
def calibrated(folder: Path) -> Any:
    """Output of ``bench run`` about a short calibration."""
    done = command_in(folder)("run", "calibration_12_orientations", "--unit", "SIM-0001", "--seed", 3, *FAST, "--json")
    assert done.code == {"pass": 0, "fail": 1}[done.json()["job"]["verdict"]], done.err
    return done.json()


def test_the_demonstration_prints_coefficients_verdicts_and_addresses(bench: Command, free_port: int) -> None:
    done = bench("demo", "--once", BENCH_PORT=str(free_port))
    assert done.code == 0, done.err
    assert done.out.count("gyro K") == done.out.count("accelerometer K") == 9
    assert "truth" in done.out
    assert "of its own standard uncertainty" in done.out
    for procedure in ("calibration_12_orientations", "verification_9_orientations"):
        assert f"{procedure}: verdict pass, page http://127.0.0.1:{free_port}/jobs/" in done.out
    assert "Idle" not in done.err
    with socket.socket() as probe:
        assert probe.connect_ex(("127.0.0.1", free_port)) != 0


def test_a_run_gives_job_and_result_with_what_was_set(calibrated: Any) -> None:
    job, result = calibrated["job"], calibrated["result"]
    assert (job["state"], job["seed"]) == ("succeeded", 3)
    assert job["requested_parameters"] == {"dwell_s": 5.0, "settle_s": 0.5}
    assert result["lineage"]["job"] == job["id"]
    assert len(result["lineage"]["recordings"]) == 12


def test_the_exit_code_is_the_verdict(bench: Command, bench_here: Command) -> None:
    good = bench_here("run", "no_operation", "--unit", "SIM-0001")
    assert (good.code, "verdict pass" in good.out) == (0, True)
    limits = 'limits={"gyro_bias_in_run_deg_h": 1e-9}'
    bad = bench("run", "calibration_12_orientations", "--unit", "SIM-0001", "--seed", 3, *FAST, "--set", limits)
    assert (bad.code, "verdict fail" in bad.out) == (1, True)


def test_jobs_are_listed_newest_first(folder: Path, calibrated: Any) -> None:
    bench = command_here(folder)
    table = bench("jobs")
    assert table.code == 0
    assert calibrated["job"]["id"] in table.out
    assert "calibration_12_orientations" in table.out
    listed = bench("jobs", "--json", "--state", "succeeded", "--unit", "SIM-0001", "--limit", 1).json()
    assert [job["id"] for job in listed["items"]] == [calibrated["job"]["id"]]


def test_samples_go_out_as_csv_parquet_and_arrow(folder: Path, calibrated: Any) -> None:
    bench = command_here(folder)
    recording = calibrated["result"]["lineage"]["recordings"][0]["id"]
    files = {form: folder / f"out.{form}" for form in ("csv", "parquet", "arrow")}
    for file in files.values():
        done = bench("export", recording, "-o", file, "--channels", "gyro_y", "--start-s", 1, "--stop-s", 2)
        assert done.code == 0, done.err
        assert f"{file.stat().st_size} bytes" in done.out
        assert not file.with_name(file.name + ".part").exists()
    lines = [line for line in files["csv"].read_text().splitlines() if not line.startswith("#")]
    assert lines[0] == "time_s,gyro_y"
    text = np.array([float(line.split(",")[1]) for line in lines[1:]])
    parquet = pq.read_table(files["parquet"]).column("gyro_y").to_numpy()
    arrow = pa.ipc.open_stream(files["arrow"].read_bytes()).read_all().column("gyro_y").to_numpy()
    assert len(text) == 400
    np.testing.assert_array_equal(text, parquet)
    np.testing.assert_array_equal(text, arrow)


def test_what_cannot_be_exported_leaves_no_file(folder: Path, calibrated: Any) -> None:
    bench = command_here(folder)
    recording = calibrated["result"]["lineage"]["recordings"][0]["id"]
    refused = bench("export", recording, "-o", folder / "out.xls")
    assert refused.code == 2
    assert "none of csv, parquet, arrow, npy, feather, h5, mat, mcap, zip" in refused.err
    one_line(bench("export", "none", "-o", folder / "none.csv"), "there is no recording 'none'")
    assert not list(folder.glob("out.xls*")) + list(folder.glob("none.csv*"))


def still_poses(path: Path) -> None:
    """Accelerometers turned by hand: 25 s of rest, then 14 poses of 4 s at 50 Hz, in m/s²."""
    rng = np.random.Generator(np.random.PCG64(5))
    directions = [[1, 0, 0], [-1, 0, 0], [0, 1, 0], [0, -1, 0], [0, 0, 1], [0, 0, -1]]
    directions += [[x, y, z] for x in (1, -1) for y in (1, -1) for z in (1, -1)]
    scale, bias = np.array([1.01, 0.99, 1.02]), np.array([0.05, -0.03, 0.02])
    parts = []
    for number, direction in enumerate(directions):
        force = 9.81 * np.array(direction) / np.linalg.norm(direction)
        rest = scale * force + bias + rng.normal(0.0, 0.002, (1250 if number == 0 else 200, 3))
        parts += [rest, rest[-1] + rng.normal(0.0, 3.0, (50, 3))]
    lines = ["x,y,z", *(",".join(f"{v:.6f}" for v in row) for row in np.concatenate(parts))]
    path.write_text("\n".join(lines) + "\n")


def test_a_file_is_imported_and_analysed(bench_here: Command, tmp_path: Path) -> None:
    still_poses(tmp_path / "poses.csv")
    channels = [
        {"name": f"accelerometer_{axis}", "column": axis, "quantity": "specific_force", "unit": "m/s^2"}
        for axis in "xyz"
    ]
    description = tmp_path / "poses.json"
    description.write_text(json.dumps({"unit": "HAND-1", "rate_hz": 50.0, "channels": channels}))
    imported = bench_here("import", tmp_path / "poses.csv", "--description", description, "--json")
    assert imported.code == 0, imported.err
    recording = imported.json()["id"]
    arguments = ("analyse", "scalar_calibration", "--recording", recording)
    one_line(bench_here(*arguments[:2], "--recording", "none", "--set", "gravity_m_s2=9.81"), "no recording 'none'")
    done = bench_here(*arguments, "--set", "gravity_m_s2=9.81", "--json")
    found = {p["name"]: p["estimate"] for p in done.json()["document"]["parameters"]}
    assert done.code == {"pass": 0, "fail": 1}[done.json()["verdict"]]
    assert [found[f"b_{axis}"] for axis in "xyz"] == pytest.approx([0.05, -0.03, 0.02], abs=0.002)
    assert [found[f"s_{axis}"] for axis in "xyz"] == pytest.approx([1 / 1.01, 1 / 0.99, 1 / 1.02], rel=2e-4)
    printed = bench_here(*arguments, "--set", "gravity_m_s2=9.81").out
    rows = {line.split()[1]: line for line in printed.splitlines() if line.startswith(("│ b_", "│ s_"))}
    assert set(rows) == {f"{kind}_{axis}" for kind in "bs" for axis in "xyz"}
    assert f"{found['s_x']:.6g}"[:6] in rows["s_x"]
    refused = bench_here(*arguments)
    assert refused.code == 2
    assert "gravity_m_s2 is needed" in refused.err


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (("run", "nothing", "--unit", "SIM-0001"), ("there is no procedure 'nothing'",)),
        (("run", "no_operation", "--unit", "SIM-9"), ("has no unit 'SIM-9'",)),
        (("run", "no_operation", "--unit", "SIM-0001", "--set", "dwell_s"), ("--set dwell_s", "name=value")),
        (("jobs", "--server", "http://127.0.0.1:9"), ("http://127.0.0.1:9", "does not answer")),
    ],
)
def test_what_cannot_be_done_is_one_line_and_exit_code_2(
    bench_here: Command, arguments: tuple[str, ...], words: tuple[str, ...]
) -> None:
    one_line(bench_here(*arguments), *words)


@pytest.mark.parametrize("arguments", [("run", "no_operation"), ("dance",), ("jobs", "--limit", "many")])
def test_a_wrong_use_shows_the_usage_and_exits_with_2(bench: Command, arguments: tuple[str, ...]) -> None:
    done = bench(*arguments)
    assert (done.code, done.out) == (2, "")
    assert "Usage:" in done.err


@pytest.mark.parametrize(
    ("name", "value"),
    [
        ("BENCH_PORT", "http"),
        ("BENCH_REAL_TIME_FACTOR", "-1"),
        ("BENCH_ID", "no spaces"),
    ],
)
def test_a_bad_setting_is_one_line_that_names_it(bench_here: Command, name: str, value: str) -> None:
    one_line(bench_here("jobs", **{name: value}), name, repr(value))


@pytest.mark.parametrize("url", ["nonsense", "sqlite:////proc/none/bench.sqlite", "sqlite:///:memory:"])
def test_a_database_that_cannot_be_opened_is_one_line(bench_here: Command, url: str) -> None:
    one_line(bench_here("jobs", BENCH_DATABASE_URL=url))


@pytest.mark.parametrize(
    ("name", "content"),
    [("BENCH_UNIT_TRUTH", None), ("BENCH_TRUTH", "id = "), ("BENCH_UNIT_TRUTH", "serial = 3")],
)
def test_a_truth_file_that_cannot_be_used_is_one_line(
    bench_here: Command, tmp_path: Path, name: str, content: str | None
) -> None:
    file = tmp_path / "truth.toml"
    if content is not None:
        file.write_text(content)
    one_line(bench_here("run", "no_operation", "--unit", "SIM-0001", **{name: str(file)}), str(file))


@pytest.fixture
def served(tmp_path: Path, free_port: int) -> Generator[BenchProcess]:
    made = BenchProcess(f"sqlite:///{tmp_path / 'bench.sqlite'}", free_port, tmp_path, real_time_factor="400")
    made.start()
    yield made
    if made.process.poll() is None:
        made.terminate()
    made.client.close()


def test_a_second_process_is_kept_off_the_bench_and_the_port_but_may_read(
    served: BenchProcess, bench: Command, bench_here: Command, free_port: int
) -> None:
    one_line(bench("serve", BENCH_PORT=str(free_port)), f"port {free_port}", "is taken", "BENCH_PORT")
    one_line(bench_here("run", "no_operation", "--unit", "SIM-0001"), "bench 'sim'")
    one_line(bench_here("serve", "--port", "0"), "bench 'sim'")
    assert bench_here("jobs", "--json").json() == {"items": [], "next": None}
    server = f"http://127.0.0.1:{free_port}"
    assert bench_here("run", "no_operation", "--unit", "SIM-0001", "--server", server).code == 0
    assert len(bench_here("jobs", "--json", "--server", server).json()["items"]) == 1


def test_a_service_that_is_asked_to_end_does_so_soon_and_its_job_goes_on_after_the_next_start(
    served: BenchProcess,
) -> None:
    body = {"procedure": "calibration_12_orientations", "unit": "SIM-0001", "seed": 7}
    job = served.client.post("/api/v1/jobs", json=body).json()["id"]
    served.station_reached(job, 3)
    assert served.terminate(signal.SIGHUP) < ENDING_S, "a job was waited for that does not end"
    assert "Traceback" not in served.log.read_text()
    assert "supervisor" not in served.state().by, "the service made its bench safe itself"
    served.start()
    ended = served.station_reached(job, 13)
    assert (ended["state"], ended["verdict"]) == ("succeeded", "pass"), ended
    items = served.recordings(job)
    assert sorted(r["station"]["index"] for r in items if r["state"] == "complete") == list(range(12))
    assert served.terminate() < ENDING_S, "a job was waited for that does not end"
    assert "Traceback" not in served.log.read_text()
