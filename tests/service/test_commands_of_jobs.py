"""Commands that ask a service about jobs, plans and evidence, over HTTP, in this process."""

import json
import os
from collections.abc import Callable, Generator
from pathlib import Path

import h5py
import httpx
import numpy as np
import pytest

from bench_service.cli.asking import leaving
from bench_service.cli.commands import run_command_line
from bench_service.cli.options import console, errors
from bench_service.formats.certificate.rules import attached
from bench_service.formats.certificate.signature import new_key, verified
from bench_service.settings import Settings
from bench_service.wall_clock import monotonic_s, pause
from tests.kit.command_line import Done, one_line
from tests.kit.served import served

Bench = Callable[..., Done]


@pytest.fixture(scope="module")
def address(tmp_path_factory: pytest.TempPathFactory) -> Generator[str]:
    """A service on a loopback port that drives a bench at 200 times real time."""
    with served(tmp_path_factory.mktemp("served"), real_time_factor=200.0) as at:
        yield at


@pytest.fixture
def bench(address: str, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch) -> Bench:
    """``bench … --server address``."""
    for each in (console, errors):
        monkeypatch.setattr(each, "_width", 200)

    def run(*arguments: object) -> Done:
        capsys.readouterr()
        code = run_command_line(Settings.model_validate({}), [*map(str, arguments), "--server", address])
        printed = capsys.readouterr()
        return Done(code, printed.out, printed.err)

    return run


def test_jobs_are_queued_ordered_paused_and_cancelled(bench: Bench) -> None:
    job = ("run", "static_run", "--unit", "SIM-0001", "--no-wait", "--json")
    first = bench(*job, "--set", "duration_s=36000", "--by", "Olena").json()["job"]
    second = bench(*job, "--priority", 20, "--key", "one").json()["job"]
    assert bench(*job, "--priority", 20, "--key", "one").json()["job"]["id"] == second["id"], "the key makes one job"
    third = bench(*job, "--priority", 30, "--label", "lot=7").json()["job"]
    waiting = [entry["job"] for entry in bench("queue", "--json").json()["entries"]]
    assert waiting[-2:] == [second["id"], third["id"]]
    assert bench("job", "priority", third["id"], 1).code == 0
    assert third["id"] in bench("queue").out.split(second["id"])[0]
    shown = bench("job", "show", first["id"]).out
    assert "Olena" in shown
    assert '{"duration_s": 36000}' in shown
    for name in (first["number"], f"#{first['number']}"):
        assert bench("job", "show", name, "--json").json()["id"] == first["id"]
    assert f"#{first['number']} " in bench("jobs").out
    assert f"job {second['id']} is paused" in bench("job", "pause", second["id"]).out
    assert f"job {second['id']} is queued" in bench("job", "resume", second["id"], "--no-wait").out
    one_line(bench("job", "answer", third["id"], "--done"), "has no open prompt")
    assert [j["id"] for j in bench("jobs", "--label", "lot=7", "--json").json()["items"]] == [third["id"]]
    for made in (third, second, first):
        assert bench("job", "cancel", made["id"]).code == 0
    ended = bench("job", "wait", first["id"])
    assert ended.code == 2
    assert f"bench: job {first['id']} cancelled" in ended.err


def test_a_reservation_is_made_listed_and_ended(bench: Bench) -> None:
    reserved = bench("reserve", "--unit", "SIM-0001", "--holder", "Olena", "--minutes", 5, "--json").json()
    assert reserved["id"] in bench("reservations", "--active").out
    assert bench("unreserve", reserved["id"]).code == 0
    assert reserved["id"] not in bench("reservations", "--active").out
    assert reserved["id"] in bench("reservations").out


def test_a_stop_is_released_with_a_name_and_a_remark(bench: Bench, address: str) -> None:
    release = ("release", "--remark", "looked at the table", "--by", "Olena")
    one_line(bench(*release), "is not stopped")
    httpx.post(f"{address}/api/v1/benches/sim/stop", json={"reason": "a test"}).raise_for_status()
    until = monotonic_s() + 20
    while not httpx.get(f"{address}/api/v1/benches/sim").json()["safety"]["safe"]:
        assert monotonic_s() < until
        pause(0.05)
    done = bench(*release)
    assert done.code == 0, done.err
    assert "the bench takes jobs again" in done.out
    assert httpx.get(f"{address}/api/v1/benches/sim/stops").json()["items"][0]["released_by"] == "Olena"


def test_a_plan_is_previewed_and_many_at_once(bench: Bench, tmp_path: Path) -> None:
    one = bench("preview", "calibration_12_orientations", "--unit", "SIM-0001", "--set", "dwell_s=30")
    assert one.code == 0, one.err
    assert "12 stations" in one.out
    assert "Expected uncertainties" in one.out
    plans = [
        {"procedure": "no_operation", "unit": "SIM-0001"},
        {"procedure": "static_run", "unit": "SIM-0001", "parameters": {"duration_s": -1}},
        {"procedure": "none", "unit": "SIM-0001"},
        {"procedure": "no_operation", "unit": "OTHER"},
    ]
    file = tmp_path / "plans.json"
    file.write_text(json.dumps(plans))
    many = bench("preview", "--plans", file, "--json")
    assert many.code == 1
    good, *bad = many.json()
    assert good["preview"]["procedure"] == "no_operation"
    assert [one["refusal"]["status"] for one in bad] == [422, 404, 422]
    assert bad[0]["refusal"]["errors"][0]["field"] == "parameters.duration_s"
    assert all(one["preview"] is None for one in bad)
    one_line(bench("preview", "--plans", file, "no_operation"), "either")


def test_a_batch_gives_what_single_previews_give(bench: Bench, tmp_path: Path) -> None:
    dwells = (20.0, 35.0, 50.0)
    name = "calibration_12_orientations"
    plans = [{"procedure": name, "unit": "SIM-0001", "parameters": {"dwell_s": dwell}} for dwell in dwells]
    (tmp_path / "plans.json").write_text(json.dumps(plans))
    many = [one["preview"] for one in bench("preview", "--plans", tmp_path / "plans.json", "--json").json()]
    alone = ["preview", name, "--unit", "SIM-0001", "--json", "--set"]
    assert many == [bench(*alone, f"dwell_s={dwell}").json() for dwell in dwells]


def test_the_catalogue_and_what_is_stored_are_listed(bench: Bench) -> None:
    done = bench("run", "no_operation", "--unit", "SIM-0001", "--label", "lot=8", "--json").json()
    assert "static_run" in bench("procedures").out
    assert "duration_s" in bench("procedures", "static_run").out
    assert "noise_analysis" in bench("methods").out
    one_line(bench("methods", "none"), "noise_analysis")
    assert "SIM-0001" in bench("units").out
    assert bench("units", "SIM-0001").json()["serial"] == "SIM-0001"
    assert bench("recordings", "--label", "lot=8", "--json").json() == {"items": [], "next": None}
    (result,) = bench("results", "--label", "lot=8", "--json").json()["items"]
    assert result["id"] == done["result"]["id"]
    assert "verdict pass" in bench("results", result["id"]).out
    assert done["job"]["id"] in [j["id"] for j in bench("jobs", "--text", "no_op", "--json").json()["items"]]
    one_line(bench("jobs", "--since", "yesterday"), "since")


class Impatient:
    """A person who presses Ctrl-C again at the second request."""

    def __init__(self, client: httpx.Client) -> None:
        self._client = client
        self._asked = 0
        self.base_url = client.base_url
        self.build_request = client.build_request

    def send(self, request: httpx.Request) -> httpx.Response:
        self._asked += 1
        if self._asked > 2:
            raise KeyboardInterrupt
        return self._client.send(request)


def test_a_station_that_is_given_up_leaves_the_pause_asked_for(bench: Bench, address: str) -> None:
    run = ("run", "static_run", "--unit", "SIM-0001", "--no-wait", "--json", "--set", "duration_s=36000")
    job = bench(*run).json()["job"]
    said: list[str] = []
    with httpx.Client(base_url=address) as client:
        while client.get(f"/api/v1/jobs/{job['id']}").json()["state"] == "queued":
            pause(0.02)
        leaving.leave(Impatient(client), job, None, said.append)  # pyright: ignore[reportArgumentType]
        assert client.get(f"/api/v1/jobs/{job['id']}").json()["pause_requested"]
    assert "Ctrl-C again" in said[0]
    assert "It does not continue by itself" in said[1]
    bench("job", "cancel", job["id"])


def test_the_shell_completes_commands_and_procedures(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    def answered(*arguments: str) -> str:
        assert run_command_line(Settings.model_validate({}), list(arguments)) == 0
        return capsys.readouterr().out

    assert answered("--version").startswith("bench 0.")
    assert "_BENCH_COMPLETE" in answered("completion", "bash")
    asked = {"_BENCH_COMPLETE": "complete_bash", "COMP_WORDS": "bench run stat", "COMP_CWORD": "2"}
    monkeypatch.setattr(os, "environ", {**os.environ, **asked})
    assert answered().split() == ["static_run"]


def test_known_coefficients_are_entered_chosen_approved_and_rejected(bench: Bench, tmp_path: Path) -> None:
    file = tmp_path / "passport.json"
    names = [f"{name}" for i in (1, 2, 3) for name in (f"b_{'xyz'[i - 1]}", f"K{i}1", f"K{i}2", f"K{i}3")]
    ones = ("K11", "K22", "K33")
    coefficients = [
        {
            "name": name,
            "value": 1.0 if name in ones else 0.0,
            "unit": "m/s^2" if name.startswith("b") else "1",
            "standard_uncertainty": 1e-4,
        }
        for name in names
    ]
    body = {"triad": "accelerometer", "origin": "passport 12/7", "coefficients": coefficients}
    file.write_text(json.dumps(body))
    entered = bench("calibration", "enter", "SIM-0001", file, "--choose", "--by", "Olena", "--json")
    assert entered.code == 0, entered.err
    one = json.loads(entered.out)
    assert (one["triad"], one["current"]) == ("accelerometer", True)
    assert "passport 12/7" in bench("calibrations", "SIM-0001").out
    assert bench("calibration", "approve", "SIM-0001", one["id"], "--valid-until", "2099-01-01T00:00:00Z").code == 0
    refused = bench("calibration", "reject", "SIM-0001", one["id"], "--remark", "wrong unit", "--json")
    assert json.loads(refused.out)["approval"] == "rejected"
    one_line(bench("calibration", "choose", "SIM-0001"), "exactly one of")
    file.write_text("{")
    one_line(bench("calibration", "enter", "SIM-0001", file), "no JSON")


def test_corrections_are_listed_and_decided(bench: Bench, address: str) -> None:
    axis = {"scale": 1.2, "bias_m_s2": 0.0, "alpha": [0, 1e-5, 0, 0], "beta": [0] * 4}
    axis |= {"alpha_sd": [0, 1e-6, 0, 0], "beta_sd": [0] * 4}
    entry = ("analyse", "entered_thermal_correction", "--set", "origin=passport 12/7")
    one_line(bench(*entry, "--set", f"axes={json.dumps([axis] * 3)}"), "unit")
    for _ in range(2):
        assert bench(*entry, "--set", f"axes={json.dumps([axis] * 3)}", "--unit", "SIM-0001").code == 0
    new, old = bench("corrections", "SIM-0001", "--kind", "thermal", "--json").json()
    assert (new["current"], old["current"]) == (False, False), "a method's correction counts when a person says so"
    assert (
        f"correction {new['id']} of the kind 'thermal' comes from a second analysis"
        in bench("corrections", "SIM-0001").out
    )
    chosen = bench("correction", "choose", "SIM-0001", old["id"], "--by", "Ann", "--remark", "the passport's", "--json")
    assert chosen.json()["current"] is True
    assert [(d["act"], d["by"], d["remark"]) for d in chosen.json()["decisions"]] == [
        ("chosen", "Ann", "the passport's")
    ]
    assert bench("correction", "approve", "SIM-0001", old["id"], "--valid-until", "2099-01-01T00:00:00Z").code == 0
    assert "no job that passed" in bench("correction", "choose", "SIM-0001", "--by-rule", "thermal").err
    assert "exactly one of CORRECTION_ID and --by-rule KIND" in bench("correction", "choose", "SIM-0001").err
    assert "2099-01-01" in bench("corrections", "SIM-0001").out
    assert bench("correction", "reject", "SIM-0001", old["id"]).code == 2, "a rejection has a reason"
    refused = bench("correction", "reject", "SIM-0001", old["id"], "--remark", "another unit", "--json").json()
    assert [d["act"] for d in refused["decisions"]] == ["chosen", "approved", "rejected"]
    shown = bench("corrections", "SIM-0001").out
    assert "chosen, not usable" in shown
    assert "another unit; make another correction" in shown
    one_line(bench("corrections", "SIM-0001", "--kind", "magnetic"), "kind")
    one_line(bench("correction", "choose", "SIM-0001", "none"), "correction")


def test_a_calibration_is_entered_from_a_file_and_exported(bench: Bench, tmp_path: Path) -> None:
    """Seen once: `enter` ended in a stack trace before anything was sent."""
    names = [name for axis, i in zip("xyz", "123", strict=True) for name in (f"b_{axis}", *(f"K{i}{j}" for j in "123"))]
    rows = [{"name": n, "value": float(n in ("K11", "K22", "K33")), "standard_uncertainty": 1e-6} for n in names]
    for row in rows:
        row["unit"] = "rad/s" if row["name"].startswith("b") else "1"
    entry = tmp_path / "entry.json"
    entry.write_text(json.dumps({"triad": "gyro", "origin": "passport 17", "coefficients": rows}))
    entered = bench("calibration", "enter", "SIM-0001", entry, "--json")
    assert entered.code == 0, entered.err
    known = entered.json()["id"]
    shown = bench("calibration", "export", "SIM-0001", known)
    assert json.loads(shown.out)["triads"][0]["calibration"] == known
    file = tmp_path / "gyro.h"
    assert bench("calibration", "export", "SIM-0001", known, "--format", "c", "-o", file).code == 0
    assert "correct_gyro" in file.read_text()
    laboratory = tmp_path / "lab.toml"
    place = 'name = "A"\ncountry = "UA"\ncity = "Kyiv"\n'
    laboratory.write_text(
        f'identifier = "K-1"\n[laboratory]\n{place}[customer]\n{place}[[people]]\nname = "Ann"\nrole = "head"\n'
    )
    pair = new_key("Lab")
    (tmp_path / "lab.key.pem").write_bytes(pair.key)
    (tmp_path / "lab.cert.pem").write_bytes(pair.certificate)
    key, made = tmp_path / "lab.key.pem", tmp_path / "c.xml"
    make = ("certificate", "make", "SIM-0001", known, "--laboratory", laboratory, "--key", key, "-o", made)
    signed = bench(*make, "--pdf", tmp_path / "c.pdf")
    assert signed.code == 0, signed.err
    root, _ = verified(made.read_bytes(), pair.certificate)
    assert attached(root)["triads"][0]["calibration"] == known
    for file in (made, tmp_path / "c.pdf"):
        checked = bench("certificate", "check", file, "--certificate", tmp_path / "lab.cert.pem")
        assert checked.code == 0, checked.err
        assert "valid, unchanged, signed by CN=Lab" in checked.out
        assert ("the pages are not checked" in checked.out) == (file.suffix == ".pdf")
        assert "entered from passport 17: there are no raw data" in checked.out
    one_line(bench("certificate", "check", laboratory, "--certificate", tmp_path / "lab.cert.pem"), "not XML")
    (tmp_path / "no.pdf").write_bytes(b"%PDF-1.7\n")
    one_line(bench("certificate", "check", tmp_path / "no.pdf", "--certificate", tmp_path / "lab.cert.pem"), "PDF")
    assert bench("calibration", "reject", "SIM-0001", known, "--remark", "wrong unit").code == 0
    one_line(bench(*make), "no certificate can be made of it: calibration")
    refused = bench("calibration", "export", "SIM-0001", known, "--format", "excel")
    assert refused.code != 0
    assert "ardupilot" in refused.err
    entry.write_text("{")
    assert "no JSON" in bench("calibration", "enter", "SIM-0001", entry).err


def test_samples_go_out_in_si_and_a_job_as_a_zip(bench: Bench, address: str, tmp_path: Path) -> None:
    terms = {"procedure": "calibration_12_orientations", "unit": "SIM-0001", "parameters": {"dwell_s": 5.0}}
    job = httpx.post(f"{address}/api/v1/jobs", json=terms).json()["id"]
    ended(address, job)
    recording = httpx.get(f"{address}/api/v1/recordings", params={"job": job}).json()["items"][0]["id"]
    physical = ("--values", "physical", "--decimate", "10")
    for name, more, kind in (
        ("s.h5", (), "raw"), ("s.mat", (), "raw"), ("s.feather", (), "raw"), ("s.npy", (), "raw"),
        ("s.mcap", (), "physical"), ("m.mat", ("--decimate", "10"), "physical"), ("s.csv", physical, "physical"),
    ):  # fmt: skip
        done = bench("export", recording, "-o", tmp_path / name, *more)
        assert (done.code, done.out.split(", ")[-1].strip()) == (0, f"{kind} values"), name
        assert ("the samples are simulated" in done.err) is (name == "s.csv"), name
    assert (tmp_path / "s.csv").read_text().startswith("time_s,gyro_x_rad_per_s,")
    with h5py.File(tmp_path / "s.h5") as store:
        assert store["gyro_x"].dtype == np.int32
    proposal = bench("import", tmp_path / "s.h5", "--describe")
    assert '"simulated": true' in proposal.out
    assert bench("import", tmp_path / "s.h5", "--yes").code == 0
    again = httpx.get(f"{address}/api/v1/recordings", params={"limit": 1}).json()["items"][0]
    first = httpx.get(f"{address}/api/v1/recordings/{recording}").json()
    assert (again["simulated"], again["content_hash"]) == (True, first["content_hash"])
    one_line(bench("export", recording, "-o", tmp_path / "s.xls"), "csv, parquet, arrow, npy, feather, h5, mat, mcap")
    one_line(bench("export", job, "-o", tmp_path / "job.zip", "--start-s", "1"), "whole recordings")
    assert bench("export", job, "-o", tmp_path / "job.zip", "--decimate", "100").code == 0
    assert (tmp_path / "job.zip").read_bytes().startswith(b"PK")
    result = httpx.get(f"{address}/api/v1/jobs/{job}").json()["result"]
    for named in ((result,), ("--unit", "SIM-0001")):
        assert bench("report", *named, "-o", tmp_path / "report.pdf").code == 0
        assert (tmp_path / "report.pdf").read_bytes().startswith(b"%PDF-")
    one_line(bench("report", "-o", tmp_path / "report.pdf"), "exactly one of")


def test_a_certificate_of_a_job_is_made_and_recomputed(bench: Bench, address: str, tmp_path: Path) -> None:
    """The short plan fails its limits: without --failed there is no certificate."""
    terms = {"procedure": "calibration_12_orientations", "unit": "SIM-0001", "parameters": {"dwell_s": 5.0}}
    job = httpx.post(f"{address}/api/v1/jobs", json=terms).json()["id"]
    ended(address, job)
    result = httpx.get(f"{address}/api/v1/jobs/{job}").json()["result"]
    calibrations = httpx.get(f"{address}/api/v1/units/SIM-0001/calibrations").json()["items"]
    gyro = next(c["id"] for c in calibrations if c["result"] == result and c["triad"] == "gyro")
    place = 'name = "A"\ncountry = "UA"\ncity = "Kyiv"\n'
    people = '[[people]]\nname = "Ann"\nrole = "head"\n'
    (tmp_path / "lab.toml").write_text(f'identifier = "K-1"\n[laboratory]\n{place}[customer]\n{place}{people}')
    pair = new_key("Lab")
    (tmp_path / "lab.key.pem").write_bytes(pair.key)
    (tmp_path / "lab.cert.pem").write_bytes(pair.certificate)
    files = ("--laboratory", tmp_path / "lab.toml", "--key", tmp_path / "lab.key.pem", "-o", tmp_path / "c.xml")
    one_line(bench("certificate", "make", "SIM-0001", gyro, *files), "is fail; with --failed a certificate states")
    made = bench("certificate", "make", "SIM-0001", gyro, *files, "--failed", "--pdf", tmp_path / "c.pdf")
    assert made.code == 0, made.err
    checked = bench("certificate", "check", tmp_path / "c.pdf", "--certificate", tmp_path / "lab.cert.pem")
    assert checked.code == 0, checked.err
    for triad in ("gyro", "accelerometer"):
        assert f"{triad} triad: 12 recordings have the hashes of the certificate, and their analysis" in checked.out
    assert "the same numbers to the last digit" in checked.out
    short = bench(
        "certificate", "check", tmp_path / "c.xml", "--certificate", tmp_path / "lab.cert.pem", "--no-recompute"
    )
    assert "not analysed again" in short.out


def ended(address: str, job: str) -> None:
    """Wait until a job has ended."""
    deadline = monotonic_s() + 60.0
    while httpx.get(f"{address}/api/v1/jobs/{job}").json()["state"] not in ("succeeded", "failed"):
        assert monotonic_s() < deadline
        pause(0.05)
