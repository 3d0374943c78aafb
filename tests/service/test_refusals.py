"""A wrong request is refused in words, by field, value and reason, and leaves nothing behind."""

import gzip
import json
from collections.abc import Generator
from pathlib import Path
from typing import Any

import httpx
import pytest

from bench_service.cli.asking.client import connect
from bench_service.settings import Settings
from bench_service.wall_clock import pause
from tests.service.client import Client

CALIBRATION = "calibration_12_orientations"
VERIFICATION = "verification_9_orientations"
JOB = {"procedure": CALIBRATION, "unit": "SIM-0001"}
GYRO_X = {"name": "gyro_x", "quantity": "angular_rate", "unit": "rad/s"}
GYRO_Y = {**GYRO_X, "name": "gyro_y"}
DESCRIPTION = {"unit": "FILE-1", "channels": [GYRO_X, GYRO_Y], "rate_hz": 100.0}
HEAD = b"gyro_x,gyro_y\n"
GOOD = HEAD + b"1,2\n3,4\n5,6\n"
GRAVITY = {"gravity_m_s2": 9.81}


def problem_of(answer: httpx.Response, status: int) -> dict[str, Any]:
    """The problem document of a refusal that is well formed."""
    assert answer.status_code == status, answer.text
    assert answer.headers["content-type"] == "application/problem+json"
    problem = answer.json()
    assert problem["status"] == status
    assert problem["title"]
    assert problem["instance"] == answer.request.url.path
    assert "Traceback" not in answer.text
    return problem


def assert_names(answer: httpx.Response, status: int, *words: str) -> None:
    """A refusal whose sentence has all the words."""
    problem = problem_of(answer, status)
    assert all(word in problem["detail"] for word in words), problem["detail"]


def assert_field(answer: httpx.Response, field: str, value: object, words: str) -> None:
    """A 422 that names a field, what it was and what it may be, in the list and in the sentence."""
    problem = problem_of(answer, 422)
    found = [e for e in problem["errors"] if e["field"] == field]
    assert found, problem["errors"]
    assert found[0]["value"] == value
    assert words in found[0]["message"]
    assert field in problem["detail"]


def send_json(client: Client, path: str, text: str | bytes) -> httpx.Response:
    return client.http.post(path, content=text, headers={"Content-Type": "application/json"})


@pytest.fixture
def client(sqlite_client: Client) -> Generator[Client]:
    """The service, which must have as much in store after the test as before."""
    before = sqlite_client.stored()
    yield sqlite_client
    assert sqlite_client.stored() == before


# Jobs: this test must be the first that needs a unit's calibration to be absent.


def test_a_verification_before_any_calibration_says_what_to_do_first(client: Client) -> None:
    body = {**JOB, "procedure": VERIFICATION}
    for answer in (client.http.post("/api/v1/jobs", json=body), client.preview(VERIFICATION)):
        assert_names(answer, 422, "SIM-0001", "no calibration", "calibrate it first")


@pytest.mark.parametrize(
    ("changes", "status", "words"),
    [
        ({"procedure": "calibration_13_orientations"}, 404, ("procedure", "'calibration_13_orientations'")),
        ({"unit": "SIM-9999"}, 422, ("'SIM-9999'", "it has SIM-0001")),
        ({"bench": "basement"}, 404, ("bench", "'basement'")),
    ],
)
def test_an_unknown_procedure_unit_or_bench_is_named(
    client: Client, changes: dict[str, Any], status: int, words: tuple[str, ...]
) -> None:
    assert_names(client.http.post("/api/v1/jobs", json={**JOB, **changes}), status, *words)


PARAMETERS = [
    ({"dwell_s": 0}, "dwell_s", 0, "greater than or equal to 1"),
    ({"dwell_s": -1}, "dwell_s", -1, "greater than or equal to 1"),
    ({"dwell_s": 1e9}, "dwell_s", 1e9, "less than or equal to 86400"),
    ({"dwell_s": "long"}, "dwell_s", "long", "valid number"),
    ({"dwell": 70}, "dwell", 70, "not permitted"),
    ({"scalar_check": "perhaps"}, "scalar_check", "perhaps", "valid boolean"),
    ({"rotation_order": "y_after_x"}, "rotation_order", "y_after_x", "'x_after_z' or 'z_after_x'"),
    ({"gravity_m_s2": 1.62}, "gravity_m_s2", 1.62, "greater than or equal to 9.7"),
    ({"orientations": "all"}, "orientations", "all", "valid tuple"),
    ({"orientations": [[0, 361]]}, "orientations.0.1", 361, "less than or equal to 360"),
    ({"limits": {"condition_max": 0}}, "limits.condition_max", 0, "greater than or equal to 1"),
]


@pytest.mark.parametrize(("parameters", "field", "value", "words"), PARAMETERS)
def test_a_parameter_that_is_not_allowed_is_named_with_its_range(
    client: Client, parameters: dict[str, Any], field: str, value: object, words: str
) -> None:
    job = client.http.post("/api/v1/jobs", json={**JOB, "parameters": parameters})
    for answer in (job, client.preview(**parameters)):
        assert_field(answer, f"parameters.{field}", value, words)


@pytest.mark.parametrize(("literal", "shown"), [("NaN", "nan"), ("Infinity", "inf"), ("-Infinity", "-inf")])
def test_a_number_that_is_none_is_refused_wherever_it_stands(client: Client, literal: str, shown: str) -> None:
    job = json.dumps({**JOB, "parameters": {"dwell_s": None}}).replace("null", literal)
    assert_field(send_json(client, "/api/v1/jobs", job), "parameters.dwell_s", shown, "finite number")
    priority = json.dumps({**JOB, "priority": None}).replace("null", literal)
    assert_field(send_json(client, "/api/v1/jobs", priority), "priority", shown, "finite number")
    unit = '{"sample_rate_hz": %s}' % literal
    answer = client.http.put("/api/v1/units/NEW-1", content=unit, headers={"Content-Type": "application/json"})
    assert_field(answer, "sample_rate_hz", shown, "finite number")


@pytest.mark.parametrize(
    ("field", "value", "words"),
    [
        ("seed", -1, "greater than or equal to 0"),
        ("seed", 2**48, "less than 281474976710656"),
        ("seed", 1.5, "valid integer"),
        ("priority", 0, "greater than or equal to 1"),
        ("priority", 1001, "less than or equal to 1000"),
        ("colour", "red", "not permitted"),
        ("labels", 3, "valid dictionary"),
        ("unit", "", "at least 1"),
    ],
)
def test_a_field_of_a_job_that_is_not_allowed_is_named_with_its_range(
    client: Client, field: str, value: object, words: str
) -> None:
    assert_field(client.http.post("/api/v1/jobs", json={**JOB, field: value}), field, value, words)


def test_an_orientation_beyond_an_axis_limit_is_shown_in_a_preview_and_refused_as_a_job(client: Client) -> None:
    default = client.preview().json()["parameters"]["orientations"]
    parameters = {"orientations": [*default, [0, 200]]}
    preview = client.preview(**parameters)
    assert preview.status_code == 200
    (violation,) = preview.json()["violations"]
    assert violation == "station 12 (β=0 γ=200): middle_deg = 200 is outside -190 … 190"
    job = client.http.post("/api/v1/jobs", json={**JOB, "parameters": parameters})
    assert_field(job, "stations", violation, "limit of the bench")


def test_the_other_rotation_order_is_refused_with_the_combination_that_it_loses(client: Client) -> None:
    parameters = {"rotation_order": "z_after_x"}
    job = client.http.post("/api/v1/jobs", json={**JOB, "parameters": parameters})
    for answer in (job, client.preview(**parameters)):
        problem = problem_of(answer, 422)
        assert problem["lost"] == ["misalignment difference x–z (δ_zy − δ_xy)"]
        assert problem["type"].endswith("Undetermined")
        assert "rank 8 of 9" in problem["detail"]
        assert "scalar_check=false" in problem["detail"]


def test_orientations_that_cannot_determine_a_bias_are_refused_with_what_is_lost(client: Client) -> None:
    parameters = {"orientations": [[0, 0], [90, 0], [180, 0], [-90, 0]], "scalar_check": False}
    job = client.http.post("/api/v1/jobs", json={**JOB, "parameters": parameters})
    for answer in (job, client.preview(**parameters)):
        problem = problem_of(answer, 422)
        assert problem["type"].endswith("Undetermined")
        assert problem["lost"]
        assert all(lost in problem["detail"] for lost in problem["lost"])


@pytest.mark.parametrize("text", ['{"procedure":', "procedure", b"\xff\xfe{}"])
def test_a_body_that_is_no_json_is_a_bad_request(client: Client, text: str | bytes) -> None:
    problem = problem_of(send_json(client, "/api/v1/jobs", text), 400)
    assert problem["errors"][0]["field"] == "body"


@pytest.mark.parametrize("text", ['{"procedure":', "[1, 2]", '"text"', ""])
def test_a_body_that_is_no_object_makes_no_job(client: Client, text: str) -> None:
    answer = send_json(client, "/api/v1/jobs", text)
    assert answer.status_code in (400, 422)
    assert problem_of(answer, answer.status_code)["errors"]


def test_a_key_that_made_another_job_is_refused(sqlite_client: Client) -> None:
    body = {"procedure": "no_operation", "unit": "SIM-0001"}
    key = {"Idempotency-Key": "refusal"}
    first = sqlite_client.http.post("/api/v1/jobs", json=body, headers=key)
    sqlite_client.wait(first.json()["id"])
    before = sqlite_client.stored()
    other = sqlite_client.http.post("/api/v1/jobs", json={**body, "priority": 1}, headers=key)
    assert_names(other, 409, "refusal")
    long = sqlite_client.http.post("/api/v1/jobs", json=body, headers={"Idempotency-Key": "x" * 201})
    assert problem_of(long, 422)["errors"][0]["field"] == "Idempotency-Key"
    assert sqlite_client.stored() == before


UNKNOWN = [
    ("GET", "/api/v1/procedures/none", "procedure"),
    ("POST", "/api/v1/procedures/none/preview", "procedure"),
    ("GET", "/api/v1/jobs/none", "job"),
    ("POST", "/api/v1/jobs/none/cancel", "job"),
    ("GET", "/api/v1/jobs/none/events", "job"),
    ("GET", "/api/v1/jobs/none/result", "job"),
    ("GET", "/api/v1/jobs/none/truth", "job"),
    ("GET", "/api/v1/jobs/none/analyses", "job"),
    ("POST", "/api/v1/jobs/none/analyses", "job"),
    ("GET", "/api/v1/recordings/none", "recording"),
    ("GET", "/api/v1/recordings/none/data", "recording"),
    ("GET", "/api/v1/results/none", "result"),
    ("GET", "/api/v1/units/none", "unit"),
    ("GET", "/api/v1/units/none/calibrations", "unit"),
    ("GET", "/api/v1/benches/none", "bench"),
    ("POST", "/api/v1/benches/none/stop", "bench"),
    ("GET", "/jobs/none", "job"),
    ("GET", "/results/none", "result"),
    ("GET", "/units/none", "unit"),
]


@pytest.mark.parametrize(("method", "path", "kind"), UNKNOWN)
def test_an_unknown_id_is_not_found_and_named(client: Client, method: str, path: str, kind: str) -> None:
    bodies = {"/preview": {"unit": "SIM-0001"}, "/analyses": {}}
    body = next((b for ending, b in bodies.items() if path.endswith(ending)), None) if method == "POST" else None
    assert_names(client.http.request(method, path, json=body), 404, f"there is no {kind} 'none'")


def test_an_address_that_is_none_and_a_verb_that_is_none_are_refused(client: Client) -> None:
    problem_of(client.http.get("/api/v1/launches"), 404)
    answer = client.http.delete("/api/v1/jobs")
    problem_of(answer, 405)
    assert "POST" in answer.headers["Allow"]


@pytest.mark.parametrize(
    ("path", "field", "value", "words"),
    [
        ("/api/v1/jobs?limit=0", "limit", "0", "greater than or equal to 1"),
        ("/api/v1/recordings?limit=501", "limit", "501", "less than or equal to 500"),
        ("/api/v1/jobs?state=asleep", "state", "asleep", "'queued', 'running'"),
    ],
)
def test_a_filter_that_is_not_allowed_is_named(client: Client, path: str, field: str, value: str, words: str) -> None:
    assert_field(client.http.get(path), field, value, words)


def test_an_unfinished_job_has_no_result_and_cannot_be_analysed_and_a_finished_one_not_be_cancelled(
    sqlite_client: Client,
) -> None:
    job = sqlite_client.submit(parameters={"dwell_s": 3600.0})
    sqlite_client.wait(job["id"], "running")
    path = f"/api/v1/jobs/{job['id']}"
    assert_names(sqlite_client.http.get(f"{path}/result"), 404, "no result of job", "running")
    again = sqlite_client.http.post(f"{path}/analyses", json={})
    assert_names(again, 422, "of its 12 recordings")
    sqlite_client.http.post(f"{path}/cancel")
    sqlite_client.wait(job["id"])
    before = sqlite_client.stored()
    assert_names(sqlite_client.http.post(f"{path}/cancel"), 409, "cancelled", "cannot be cancelled")
    assert_names(sqlite_client.http.get(f"{path}/result"), 404, "no result of job", "cancelled")
    assert sqlite_client.stored() == before


# Samples out.


@pytest.fixture(scope="module")
def recording(sqlite_client: Client) -> str:
    """An imported recording of three samples at 100 Hz, gyros x and y only."""
    answer = sqlite_client.import_files(DESCRIPTION, GOOD)
    assert answer.status_code == 201, answer.text
    return answer.json()["id"]


@pytest.mark.parametrize(
    ("query", "field", "value", "words"),
    [
        ("format=xml", "format", "xml", "'arrow', 'parquet', 'csv' or 'npy'"),
        ("start_s=-1", "start_s", "-1", "greater than or equal to 0"),
        ("start_s=nan", "start_s", "nan", "finite number"),
        ("start_s=5", "start_s", 5.0, "0 … 0.03, the length of the recording in seconds"),
        ("stop_s=inf", "stop_s", "inf", "finite number"),
        ("stop_s=0.5", "stop_s", 0.5, "0 … 0.03"),
        ("start_s=0.02&stop_s=0.01", "stop_s", 0.01, "not before start_s = 0.02"),
        (
            "start_s=0.02&stop_s=0.02",
            "stop_s",
            0.02,
            "none begins within 0.02 … 0.02 s; start_s and stop_s count from the",
        ),
        ("stop_s=0", "stop_s", 0.0, "first sample, 0 … 0.03"),
        ("start_s=0.03", "start_s", 0.03, "none begins within 0.03 … 0.03 s"),
        ("channels=gyro_x,gyro_x", "channels", "['gyro_x', 'gyro_x']", "each once"),
    ],
)
def test_samples_that_cannot_be_taken_out_as_asked_are_refused_by_field(
    client: Client, recording: str, query: str, field: str, value: object, words: str
) -> None:
    assert_field(client.http.get(f"/api/v1/recordings/{recording}/data?{query}"), field, value, words)
    if field != "format":
        assert_field(client.http.get(f"/api/v1/recordings/{recording}/samples?{query}"), field, value, words)


@pytest.mark.parametrize("name", ["gyro_z", "", "gyro_x;"])
def test_a_channel_that_is_not_there_is_refused_with_those_that_are(client: Client, recording: str, name: str) -> None:
    answer = client.http.get(f"/api/v1/recordings/{recording}/data", params={"channels": name})
    assert_names(answer, 422, f"no channel '{name}'", "it has gyro_x, gyro_y")


# Files in.

TIMED = [0.0, 0.01, 0.02, 0.05, 0.06]
FILES = {
    "line cut off": ({}, [HEAD + b"1,2\n3"], ("line 3 has 1 columns, 2 were expected", "cut off")),
    "gzip cut off": ({}, [gzip.compress(GOOD + b"1,2\n" * 9999)[:-20]], ("a compressed file that is cut off",)),
    "not a number": ({}, [HEAD + b"1,2\nnan,4\n"], ("line 3, column 'gyro_x': 'nan'", "finite number")),
    "a word": ({}, [HEAD + b"1,2\n3,four\n"], ("line 3, column 'gyro_y': 'four'", "finite number")),
    "unknown column": ({}, [b"gyro_x,b\n1,2\n"], ("has no column 'gyro_y'", "the columns are gyro_x, b")),
    "empty": ({}, [b""], ("line 1 is empty",)),
    "gap": (
        {"time_column": "t"},
        [b"t,gyro_x,gyro_y\n" + b"".join(b"%g,1,2\n" % t for t in TIMED)],
        ("2 samples are missing in 1 place: 2 between rows 3 and 4", 'gaps = "mark"'),
    ),
    "lengths": (
        {"channels": [GYRO_X, {**GYRO_Y, "file": 1}]},
        [b"gyro_x\n1\n2\n", b"gyro_y\n1\n"],
        ("same number of rows", "file0.csv has 2, file1.csv has 1"),
    ),
}


@pytest.mark.parametrize("case", FILES)
def test_a_file_that_is_not_as_described_is_refused_with_its_row(client: Client, case: str) -> None:
    changes, files, words = FILES[case]
    units = client.http.get("/api/v1/units").json()
    assert_names(client.import_files({**DESCRIPTION, "unit": "NEW-2", **changes}, *files), 422, "file0.csv", *words)
    assert client.http.get("/api/v1/units").json() == units


NO_UNIT = {"name": "gyro_x", "quantity": "angular_rate"}


@pytest.mark.parametrize(
    ("changes", "field", "words"),
    [
        ({"channels": [NO_UNIT]}, "channels.0.unit", "required"),
        ({"channels": [{**NO_UNIT, "unit": "m/s^2"}]}, "channels.0", "'m/s^2' is none of rad/s, mrad/s, deg/s"),
        ({"channels": [{**GYRO_X, "scale": 0}]}, "channels.0.scale", "the scale not zero"),
        ({"rate_hz": -1}, "rate_hz", "greater than 0"),
        ({"rate_hz": float("nan")}, "rate_hz", "finite number"),
        ({"unit": ""}, "unit", "should match pattern"),
        ({"colour": "red"}, "colour", "not permitted"),
    ],
)
def test_a_description_that_leaves_something_open_is_refused_by_field(
    client: Client, changes: dict[str, Any], field: str, words: str
) -> None:
    problem = problem_of(client.import_files({**DESCRIPTION, **changes}, GOOD), 422)
    error = next(e for e in problem["errors"] if e["field"] == f"description.{field}")
    assert words in error["message"]


def test_a_bad_channel_is_not_told_to_be_two_faults(client: Client) -> None:
    problem = problem_of(client.import_files({**DESCRIPTION, "channels": [NO_UNIT]}, GOOD), 422)
    assert [e["field"] for e in problem["errors"]] == ["description.channels.0.unit"]


@pytest.mark.parametrize("text", ["{unit", "[]", "", '"FILE-1"'])
def test_a_description_that_is_no_json_object_is_refused(client: Client, text: str) -> None:
    assert problem_of(client.import_files(text, GOOD), 422)["errors"][0]["field"] == "description"


def test_an_import_without_a_file_is_refused(client: Client) -> None:
    answer = client.http.post("/api/v1/recordings", data={"description": json.dumps(DESCRIPTION)})
    assert problem_of(answer, 422)["errors"][0]["field"] == "files"
    unused = client.import_files(DESCRIPTION, GOOD, GOOD)
    assert_names(unused, 422, "channels.file", "every one of the 2 files")


def test_a_file_that_is_too_large_is_refused_with_the_setting_that_says_so(tmp_path: Path) -> None:
    settings = Settings(database_url=f"sqlite:///{tmp_path / 'bench.sqlite'}", max_import_mb=0.001)
    with connect(settings, None, drive=False) as http:
        client = Client(http)
        answer = client.import_files(DESCRIPTION, HEAD + b"1,2\n" * 250)
        assert_field(answer, "files", "1014 bytes", "at most 1000 bytes (BENCH_MAX_IMPORT_MB)")
        assert client.stored()["recordings"] == []
        assert client.import_files(DESCRIPTION, HEAD + b"1,2\n" * 200).status_code == 201
        job = http.post("/api/v1/jobs", json=JOB)
        assert_names(job, 404, "no bench is registered")


# Analyses.


@pytest.fixture(scope="module")
def stations(sqlite_client: Client) -> list[str]:
    """The recordings of a calibration, in the order of its stations."""
    job = sqlite_client.wait(sqlite_client.submit(seed=5)["id"])
    return [r["id"] for r in sorted(sqlite_client.recordings(job["id"]), key=lambda r: r["station"]["index"])]


@pytest.fixture(scope="module")
def interrupted(sqlite_client: Client) -> str:
    """A recording that a cancel cut off after its first chunk, which is about 220 s of bench time."""
    for patience_s in (0.5, 1.0, 2.0, 4.0, 8.0):
        job = sqlite_client.submit(parameters={"dwell_s": 86_400.0})
        sqlite_client.wait(job["id"], "running")
        pause(patience_s)
        sqlite_client.http.post(f"/api/v1/jobs/{job['id']}/cancel")
        sqlite_client.wait(job["id"])
        found = sqlite_client.recordings(job["id"])
        if found:
            return found[0]["id"]
    raise AssertionError("no chunk was written in 8 s")


def test_a_method_or_evidence_that_is_unknown_is_not_found(client: Client, recording: str) -> None:
    assert_names(client.analyse("magic"), 404, "method 'magic'")
    assert_names(client.analyse("scalar_calibration", recordings=["none"], parameters=GRAVITY), 404, "recording 'none'")
    assert_names(client.analyse("run_to_run", calibrations=["none"]), 404, "calibration 'none'")


def test_a_method_without_evidence_is_refused(client: Client) -> None:
    assert_field(client.analyse("run_to_run"), "calibrations", 0, "at least two")
    assert_names(client.analyse("scalar_calibration", parameters=GRAVITY), 422, "no recording")


@pytest.mark.parametrize(
    ("parameters", "field", "words"),
    [
        ({}, "parameters", "gravity_m_s2 is needed"),
        ({"gravity_m_s2": 3.7}, "parameters.gravity_m_s2", "greater than or equal to 9.7"),
        ({**GRAVITY, "triad": "compass"}, "parameters.triad", "'accelerometer' or 'gyro'"),
        ({**GRAVITY, "still": {"factor": 0.5}}, "parameters.still.factor", "greater than 1"),
        ({**GRAVITY, "colour": "red"}, "parameters.colour", "not permitted"),
    ],
)
def test_a_parameter_of_a_method_is_refused_by_field(
    client: Client, recording: str, parameters: dict[str, Any], field: str, words: str
) -> None:
    problem = problem_of(client.analyse("scalar_calibration", recordings=[recording], parameters=parameters), 422)
    error = next(e for e in problem["errors"] if e["field"] == field)
    assert words in error["message"]


def test_recordings_that_do_not_fit_a_method_are_refused(client: Client, recording: str, stations: list[str]) -> None:
    def refused(*ids: str) -> httpx.Response:
        return client.analyse("scalar_calibration", recordings=ids, parameters=GRAVITY)

    assert_names(refused(recording, stations[0]), 422, "several units", "FILE-1, SIM-0001")
    assert_names(refused(recording), 422, "no channel 'accelerometer_x'", "it has gyro_x, gyro_y")
    too_few = problem_of(refused(*stations[:3]), 422)
    assert too_few["type"].endswith("Undetermined")
    assert "rank 3 of 9" in too_few["detail"]
    assert len(too_few["lost"]) == 6


def test_an_interrupted_recording_is_kept_but_not_analysed(
    client: Client, interrupted: str, stations: list[str]
) -> None:
    kept = client.http.get(f"/api/v1/recordings/{interrupted}").json()
    assert kept["state"] == "interrupted"
    assert kept["count"] > 0
    answer = client.analyse("scalar_calibration", recordings=[*stations, interrupted], parameters=GRAVITY)
    assert_names(answer, 422, interrupted, "interrupted", "not for analysis")


def test_a_second_analysis_is_held_to_the_same_rules(client: Client, stations: list[str]) -> None:
    job = client.http.get(f"/api/v1/recordings/{stations[0]}").json()["job"]
    path = f"/api/v1/jobs/{job}/analyses"
    wrong = client.http.post(path, json={"parameters": {"gravity_m_s2": 1.0}})
    assert_field(wrong, "parameters.gravity_m_s2", 1.0, "greater than or equal to 9.7")
    nan = send_json(client, path, '{"parameters": {"gravity_m_s2": NaN}}')
    assert_field(nan, "parameters.gravity_m_s2", "nan", "finite number")
    lost = problem_of(client.http.post(path, json={"parameters": {"rotation_order": "z_after_x"}}), 422)
    assert lost["lost"]


@pytest.mark.parametrize("serial", ["a/b", "<b>x</b>", "a\x00b", ".."])
def test_a_serial_that_no_address_can_name_is_refused(sqlite_client: Client, serial: str) -> None:
    answer = sqlite_client.import_files({**DESCRIPTION, "unit": serial}, GOOD)
    assert problem_of(answer, 422)["errors"][0]["field"] == "description.unit"
