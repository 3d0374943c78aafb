"""The Python client against a real service: submit to arrays, refusals in words, and a service that is away."""

import subprocess
import sys
from collections.abc import Callable, Generator
from pathlib import Path

import httpx
import numpy as np
import pytest

from bench_client import Client, Event, Job, JobEnded, Refused, TimedOut, Unavailable
from bench_client.event_stream import frames
from bench_client.results.allan_deviation import AllanDeviationResult
from bench_client.results.calibration_12_orientations import Calibration12OrientationsResult
from bench_client.results.part import OtherResult

ROOT = Path(__file__).parents[2]
FAST = {"dwell_s": 5.0, "settle_s": 0.5}


@pytest.fixture(scope="module")
def client(address: str) -> Generator[Client]:
    with Client(address, name="a test") as made:
        yield made


@pytest.fixture(scope="module")
def calibrated(client: Client) -> tuple[Job, list[float]]:
    """A calibration that has ended, and the fractions that were seen on the way."""
    preview = client.preview("calibration_12_orientations", "SIM-0001", FAST)
    assert len(preview.stations) == 12
    assert preview.predicted_uncertainties[0].standard_uncertainty > 0
    job = client.submit("calibration_12_orientations", "SIM-0001", FAST, labels={"lot": "7"}, seed=3, key="one")
    seen: list[float] = []
    ended = client.wait(job, timeout_s=60, progress=lambda now: seen.append(now.progress.fraction))
    return ended, seen


def test_a_job_is_submitted_watched_and_read_as_an_object(client: Client, calibrated: tuple[Job, list[float]]) -> None:
    job, seen = calibrated
    assert (job.state, job.labels, job.seed) == ("succeeded", {"lot": "7"}, 3)
    assert seen == sorted(seen)
    assert seen[-1] == 1.0
    result = client.result_of(job)
    assert isinstance(result, Calibration12OrientationsResult)
    matrix = np.array(result.document.triads[0].calibration.matrix)
    np.testing.assert_allclose(matrix, np.eye(3), atol=0.01)  # the simulated unit's scales are within a percent
    assert len(result.lineage.recordings) == 12
    assert client.result(result.id) == result
    again = client.submit("calibration_12_orientations", "SIM-0001", FAST, labels={"lot": "7"}, seed=3, key="one")
    assert again.id == job.id, "the same key makes the same job"
    assert [found.id for found in client.jobs(label="lot=7")] == [job.id]
    assert [found.id for found in client.results(name="calibration_12_orientations", text="SIM-0001")] == [result.id]


def test_samples_come_as_arrays_in_si_units_with_their_time(
    client: Client, calibrated: tuple[Job, list[float]]
) -> None:
    recordings = list(client.recordings(job=calibrated[0].id))[::-1]
    assert len(recordings) == 12
    one = client.recording(recordings[0].id)
    whole = one.rates()
    assert whole.values.shape == (one.view.count, len(one.view.channels))
    np.testing.assert_allclose(np.diff(whole.time_s), 1.0 / one.view.rate_hz)
    assert whole.units[whole.names.index("accelerometer_x")] == "m/s^2"
    result = client.result_of(calibrated[0])
    assert isinstance(result, Calibration12OrientationsResult)
    found = result.document.triads[1].calibration
    for recording in recordings:
        outputs = recording.rates().triad("accelerometer").mean(axis=0)
        force = np.linalg.solve(np.array(found.matrix), outputs - np.array(found.bias))
        assert np.linalg.norm(force) == pytest.approx(9.81, abs=0.02)  # the Earth's gravity, whatever the site
    assert np.abs(whole.triad("gyro").mean(axis=0)).max() < 1e-3  # rad/s: biases and the Earth's rate, no counts
    part = one.rates(["gyro_z"], start_s=1.0, stop_s=2.0)
    chosen = (whole.time_s >= 1.0) & (whole.time_s < 2.0)
    np.testing.assert_array_equal(part["gyro_z"], whole["gyro_z"][chosen])
    np.testing.assert_allclose(part.time_s, whole.time_s[chosen])
    assert part.units == ("rad/s",)
    with pytest.raises(KeyError, match="gyro_z"):
        part["gyro_x"]
    assert one.raw().dtype == np.int32


def test_a_file_is_imported_and_analysed(client: Client, tmp_path: Path) -> None:
    rng = np.random.Generator(np.random.PCG64(1))
    values = 1e-3 * rng.standard_normal(4000)
    np.savetxt(tmp_path / "hand.csv", values, header="rate", comments="")
    channel = {"name": "gyro_x", "quantity": "angular_rate", "unit": "rad/s", "column": "rate"}
    description = {"unit": "HAND-1", "rate_hz": 100.0, "channels": [channel]}
    made = client.import_files([tmp_path / "hand.csv"], description, key="import one")
    assert client.import_files([tmp_path / "hand.csv"], description, key="import one").id == made.id
    np.testing.assert_allclose(made.rates()["gyro_x"], values)
    result = client.analyse("allan_deviation", [made])
    assert isinstance(result, AllanDeviationResult)
    assert result.document.verdict == "pass"


def test_a_refusal_names_field_value_and_range(client: Client) -> None:
    with pytest.raises(Refused, match=r"parameters\.dwell_s = -1") as refused:
        client.submit("calibration_12_orientations", "SIM-0001", {"dwell_s": -1})
    assert refused.value.problem.status == 422
    with pytest.raises(Refused, match="none"):
        client.job("none")
    with pytest.raises(Refused, match="chanel"):
        list(client.recordings(chanel="gyro_x"))


def test_events_come_once_each_until_the_end(client: Client, calibrated: tuple[Job, list[float]]) -> None:
    events = [event for event in client.events(calibrated[0]) if event.sequence is not None]
    assert [event.sequence for event in events] == list(range(1, len(events) + 1))
    assert events[-1].data["state"] == "succeeded"
    assert [event.sequence for event in client.events(calibrated[0], after=5)] == list(range(6, len(events) + 1))


def test_a_job_without_result_and_one_that_takes_too_long_are_said(client: Client) -> None:
    job = client.submit("static_run", "SIM-0001", {"duration_s": 200_000.0})
    with pytest.raises(TimedOut, match="it continues in the service"):
        client.wait(job, timeout_s=0.1)
    client.cancel(job)
    ended = client.wait(job, timeout_s=30)
    assert ended.state == "cancelled"
    with pytest.raises(JobEnded, match="cancelled"):
        client.result_of(job)


class Away(httpx.BaseTransport):
    """A way to the service on which the first answers are lost, after the service has had the request."""

    def __init__(self, losses: int, lost: Callable[[], httpx.Response]) -> None:
        self._inner = httpx.HTTPTransport()
        self._losses = losses
        self._lost = lost
        self.asked = 0

    def handle_request(self, request: httpx.Request) -> httpx.Response:
        answer = self._inner.handle_request(request)
        self.asked += 1
        if self.asked <= self._losses:
            answer.read()
            answer.close()
            return self._lost()
        return answer

    def close(self) -> None:
        self._inner.close()


def cut() -> httpx.Response:
    raise httpx.ReadError("the line was cut")


@pytest.mark.parametrize("lost", [cut, lambda: httpx.Response(502, text="bad gateway")])
def test_a_create_whose_answer_was_lost_is_made_once(address: str, lost: Callable[[], httpx.Response]) -> None:
    way = Away(2, lost)
    with Client(address, http=way) as client:
        before = {job.id for job in client.jobs()}
        way.asked = 0
        made = client.submit("no_operation", "SIM-0001")
        assert way.asked == 3
        assert {job.id for job in client.jobs()} - before == {made.id}


def test_what_may_not_be_repeated_is_sent_once_and_patience_ends(address: str) -> None:
    way = Away(99, cut)
    with Client(address, http=way, patience_s=0.3) as client:
        with pytest.raises(Unavailable, match="the line was cut"):
            client.cancel("none")
        assert way.asked == 1
        with pytest.raises(Unavailable, match="GET /api/v1/jobs/none"):
            client.job("none")
        assert way.asked > 2


def test_token_and_name_go_in_headers() -> None:
    seen: list[httpx.Request] = []

    def answer(request: httpx.Request) -> httpx.Response:
        seen.append(request)
        return httpx.Response(200, json=[])

    with Client("http://bench", token="secret", name="Olena", http=httpx.MockTransport(answer)) as client:
        assert client.procedures() == {}
    assert seen[0].headers["authorization"] == "Bearer secret"
    assert seen[0].headers["x-requested-by"] == "Olena"


def test_frames_of_server_sent_events() -> None:
    stream = 'retry: 1000\n\n: still here\n\nid: 4\nevent: note\ndata: {"sequence": 4,\ndata:  "kind": "note"}\n\n'
    stream += 'event: live\ndata: {"job": null}\n\ndata: cut'
    found = list(frames(stream.split("\n")))
    assert found == [Event(kind="note", sequence=4), Event(kind="live", data={"job": None})]


def test_a_result_that_is_not_known_is_plain_json(client: Client, calibrated: tuple[Job, list[float]]) -> None:
    known = client.result_of(calibrated[0])
    from bench_client.results import result_of_document

    other = result_of_document({**known.model_dump(mode="json"), "name": "tomorrow's", "document": {"a": 1}})
    assert isinstance(other, OtherResult)
    assert other.document == {"a": 1}


def test_the_classes_of_results_are_those_of_the_document(address: str, tmp_path: Path) -> None:
    """Writing them again, by the same means as `make clients`, gives what is there."""
    (tmp_path / "openapi.json").write_text(httpx.get(f"{address}/openapi.json", timeout=60).text)
    folder = tmp_path / "client" / "bench_client" / "results"
    folder.mkdir(parents=True)
    script = tmp_path / "client" / "generate_results.py"
    script.write_text((ROOT / "client" / "generate_results.py").read_text())
    subprocess.run([sys.executable, script, tmp_path / "openapi.json"], check=True, timeout=60)
    ruff = [str(Path(sys.executable).with_name("ruff"))]
    config = ["--config", str(ROOT / "pyproject.toml")]
    subprocess.run([*ruff, "check", "--fix-only", "--quiet", *config, folder], check=True, timeout=60)
    subprocess.run([*ruff, "format", "--quiet", *config, folder], check=True, timeout=60)
    made = {file.name: file.read_text() for file in folder.glob("*.py")}
    here = {f.name: f.read_text() for f in (ROOT / "client/bench_client/results").glob("*.py") if f.name != "part.py"}
    assert made == here, "`make clients` writes them again"


def test_the_client_needs_nothing_of_the_service() -> None:
    code = "import sys, bench_client; print(*[m for m in sys.modules if m.split('.')[0] in "
    code += "('bench_service', 'procedures', 'simulators', 'pyarrow', 'scipy')])"
    done = subprocess.run([sys.executable, "-c", code], cwd=ROOT / "client", capture_output=True, text=True, check=True)
    assert done.stdout.strip() == ""
