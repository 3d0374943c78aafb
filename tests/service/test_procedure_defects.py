"""A procedure whose author made a mistake: the refusal names what to change, and nothing is tried twenty times."""

import logging
import math
from collections.abc import AsyncIterator, Callable, Generator, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from bench_service.cli.asking.client import connect
from bench_service.settings import Settings
from procedures import catalog, steps
from procedures.bench import Bench
from procedures.bench.imu import Stream
from procedures.core.limits import Limit, check, verdict
from procedures.core.recording import Recording, Station
from procedures.core.report import Report
from procedures.core.unit import Unit
from procedures.core.unit_correction import UnitCorrection
from procedures.discovery import discovered
from procedures.procedure import Context, Outcome, Parameters, Prediction, Procedure
from tests.correction_samples import converter
from tests.service.client import Client

BROKEN = {
    "half_written": "def schedule(params\n",
    "misnamed": "from procedures.catalog.no_operation import PROCEDURE\n",
    "nameless": "SOMETHING = 1\n",
    "raising": "import numpy as np\n\nLIMIT = 1 / 0\n",
    "script": "import sys\n\nsys.exit(3)\n",
}


class Params(Parameters):
    """Nothing to choose."""


class Result(Outcome):
    """Numbers, by station."""

    magnitudes_m_s2: tuple[float, ...] = (9.81, 9.81, 9.81)


def stations_from(first: int) -> Callable[[Params], tuple[Station, ...]]:
    def schedule(_: Params) -> tuple[Station, ...]:
        return tuple(Station(first + i, f"rest {i + 1}", None, None, 0.1, 0.5) for i in range(3))

    return schedule


async def acquire(bench: Bench, stations: Sequence[Station]) -> AsyncIterator[Stream]:
    for station in stations:
        yield await steps.record_station(bench, station)


async def one_too_few(bench: Bench, stations: Sequence[Station]) -> AsyncIterator[Stream]:
    for station in stations[:-1]:
        yield await steps.record_station(bench, station)


async def one_too_many(bench: Bench, stations: Sequence[Station]) -> AsyncIterator[Stream]:
    for station in (*stations, replace(stations[-1], index=3, label="one more")):
        yield await steps.record_station(bench, station)


async def backwards(bench: Bench, stations: Sequence[Station]) -> AsyncIterator[Stream]:
    for station in reversed(stations):
        yield await steps.record_station(bench, station)


def analyse(recordings: Sequence[Recording], params: Params, context: Context) -> Result:
    checks = (check("recordings", float(len(recordings)), Limit("1", minimum=3.0)),)
    return Result(checks=checks, verdict=verdict(checks))


def analyse_to_nan(recordings: Sequence[Recording], params: Params, context: Context) -> Result:
    found = analyse(recordings, params, context)
    return found.model_copy(update={"magnitudes_m_s2": (9.81, 9.81, math.nan)})


def analyse_to_infinite_check(recordings: Sequence[Recording], params: Params, context: Context) -> Result:
    checks = (check("spread", math.inf, Limit("1", maximum=3.0)),)
    return Result(checks=checks, verdict=verdict(checks))


def analyse_to_dictionary(recordings: Sequence[Recording], params: Params, context: Context) -> dict[str, str]:
    return {"verdict": "pass"}


def raising(error: BaseException) -> Callable[..., Any]:
    def fails(*_: object) -> None:
        raise error

    return fails


async def a_coroutine(bench: Bench, stations: Sequence[Station]) -> list[Stream]:
    return [await steps.record_station(bench, station) for station in stations]


def rest(**changed: object) -> Callable[[Params], tuple[Station, ...]]:
    def schedule(params: Params) -> tuple[Station, ...]:
        first, *others = stations_from(0)(params)
        return (replace(first, **changed), *others)

    return schedule


def correction_with_nan(_: Result) -> tuple[UnitCorrection, ...]:
    x, y, z = converter(1).converter or ()
    return (UnitCorrection("converter", (replace(x, scale=replace(x.scale, at_reference=math.nan)), y, z)),)


def analyse_to_boom(recordings: Sequence[Recording], params: Params, context: Context) -> Result:
    raise ValueError("boom")


def learns_nan(result: Result, unit: Unit, origin: str) -> Unit:
    return replace(unit, averaging_time_s=math.nan)


SOUND = Procedure(
    "sound",
    "Sound",
    "1.0.0",
    Params,
    Result,
    lambda params, context: params,
    stations_from(0),
    lambda params, context: Prediction(),
    acquire,
    analyse,
    lambda result: Report(),
)
DEFECTIVE = {
    "sound": SOUND,
    "numbered_from_one": replace(SOUND, schedule=stations_from(1)),
    "one_too_few": replace(SOUND, acquire=one_too_few),
    "one_too_many": replace(SOUND, acquire=one_too_many),
    "backwards": replace(SOUND, acquire=backwards),
    "nan": replace(SOUND, analyse=analyse_to_nan),
    "infinite_check": replace(SOUND, analyse=analyse_to_infinite_check),
    "nan_correction": replace(SOUND, corrections=correction_with_nan),
    "boom": replace(SOUND, analyse=analyse_to_boom),
    "learns_nan": replace(SOUND, learns=learns_nan),
    "dictionary": replace(SOUND, analyse=analyse_to_dictionary),
    "ends_in_analyse": replace(SOUND, analyse=raising(SystemExit(3))),
    "ends_in_acquire": replace(SOUND, acquire=raising(SystemExit(3))),
    "coroutine": replace(SOUND, acquire=a_coroutine),
    "unreported": replace(SOUND, report=raising(IndexError("no row"))),
    "schedule_raises": replace(SOUND, schedule=raising(KeyError("dwell"))),
    "schedule_ends": replace(SOUND, schedule=raising(SystemExit(3))),
    "infinite_settling": replace(SOUND, schedule=rest(settle_s=math.inf)),
    "negative_dwell": replace(SOUND, schedule=rest(record_s=-1.0)),
    "resolve_raises": replace(SOUND, resolve=raising(AttributeError("unit"))),
    "resolve_gives_nothing": replace(SOUND, resolve=lambda params, context: None),
    "predict_raises": replace(SOUND, predict=raising(ZeroDivisionError("dwell"))),
    "predict_gives_nothing": replace(SOUND, predict=lambda params, context: None),
    "predicts_nan": replace(SOUND, predict=lambda params, context: Prediction(math.nan)),
    "planned_checks_raises": replace(SOUND, planned_checks=raising(KeyError("limit"))),
    "expected_averaging_time_raises": replace(SOUND, expected_averaging_time=raising(KeyError("limit"))),
}
REFUSED_PLANS = {
    "schedule_raises": "`schedule` of procedure schedule_raises failed: KeyError: 'dwell' (",
    "schedule_ends": "`schedule` of procedure schedule_ends failed: SystemExit: 3 (",
    "infinite_settling": "`schedule` of procedure infinite_settling gave stations.0.settle_s = inf: a finite number",
    "negative_dwell": "`schedule` of procedure negative_dwell gave stations.0.record_s = -1.0: a time from 0 s on",
    "resolve_raises": "`resolve` of procedure resolve_raises failed: AttributeError: unit (",
    "resolve_gives_nothing": "`resolve` of procedure resolve_gives_nothing gave a NoneType, not a Params",
    "predict_raises": "`predict` of procedure predict_raises failed: ZeroDivisionError: dwell (",
    "predict_gives_nothing": "`predict` of procedure predict_gives_nothing gave a NoneType, not a Prediction",
    "predicts_nan": "`predict` of procedure predicts_nan gave prediction.duration_s = nan: a finite number",
    "numbered_from_one": "procedure numbered_from_one numbers its 3 stations 1, 2, 3: `schedule` must number them "
    "from 0, in order: 0, 1, 2, …",
}


@pytest.fixture(scope="module")
def client(tmp_path_factory: pytest.TempPathFactory) -> Generator[Client]:
    """A service whose catalogue has these procedures too, and four files that are broken."""
    folder = tmp_path_factory.mktemp("broken") / "broken_catalogue"
    folder.mkdir()
    for name, text in BROKEN.items():
        (folder / f"{name}.py").write_text(text)
    find = catalog.find

    def found(only: str | None = None):
        every = find(only)
        every.entries.update({name: replace(procedure, name=name) for name, procedure in DEFECTIVE.items()})
        every.broken.update(discovered("broken_catalogue", [str(folder)], "PROCEDURE", Procedure).broken)
        return every

    settings = Settings(database_url=f"sqlite:///{tmp_path_factory.mktemp('service') / 'bench.sqlite'}")
    with pytest.MonkeyPatch.context() as patched:
        patched.syspath_prepend(folder.parent)
        patched.setattr(catalog, "find", found)
        with connect(settings, None, drive=True) as http:
            yield Client(http)


def ended(client: Client, procedure: str) -> dict:
    answer = client.http.post("/api/v1/jobs", json={"procedure": procedure, "unit": "SIM-0001", "retries": 5})
    assert answer.status_code == 202, answer.text
    return client.wait(answer.json()["id"])


def test_a_sound_one_passes(client: Client) -> None:
    job = ended(client, "sound")
    assert (job["state"], job["verdict"], job["progress"]["station"]) == ("succeeded", "pass", 3)


@pytest.mark.parametrize(
    ("procedure", "kind", "sentence"),
    [
        ("nan", "UnfitResult", "magnitudes_m_s2.2 = nan: a result must be finite"),
        ("infinite_check", "UnfitResult", "checks.0.value = inf: a result must be finite"),
        (
            "nan_correction",
            "UnfitResult",
            "corrections.0.value.0.scale.at_reference = nan: a calibration or correction must be finite",
        ),
        (
            "one_too_few",
            "ProcedureDefect",
            "procedure one_too_few gave no stream for station 2 (rest 3): `acquire` must yield one for each station "
            "that it is given, in order",
        ),
        (
            "one_too_many",
            "ProcedureDefect",
            "procedure one_too_many gave one more stream, of station 3 (one more), after the last of its 3 stations: "
            "`schedule` must list every station that `acquire` records",
        ),
        (
            "backwards",
            "ProcedureDefect",
            "procedure backwards gave the stream of station 2 (rest 3) where station 0 (rest 1) was due: `acquire` "
            "must yield one for each station, unchanged and in order",
        ),
        ("dictionary", "ProcedureDefect", "`analyse` of dictionary gave a dict, not its Result"),
        ("ends_in_analyse", "ProcedureDefect", "`analyse` of ends_in_analyse would end the program with SystemExit(3)"),
        (
            "ends_in_acquire",
            "ProcedureDefect",
            "`acquire` of procedure ends_in_acquire would end the program with SystemExit(3)",
        ),
        (
            "coroutine",
            "ProcedureDefect",
            "`acquire` of procedure coroutine gave a coroutine: it must be an async generator, `async def` with "
            "`yield`",
        ),
    ],
)
def test_a_defect_ends_the_job_at_once_with_a_sentence(
    client: Client, procedure: str, kind: str, sentence: str
) -> None:
    job = ended(client, procedure)
    assert (job["state"], job["verdict"], job["attempt"], job["resumable"]) == ("failed", "error", 1, False)
    assert (job["error"]["kind"], job["error"]["message"]) == (kind, sentence)
    assert client.http.get("/api/v1/benches/sim").json()["safety"]["safe"] is True


def test_what_nobody_foresaw_names_file_and_line_in_job_and_log(
    client: Client, caplog: pytest.LogCaptureFixture
) -> None:
    with caplog.at_level(logging.ERROR):
        job = ended(client, "boom")
    # This procedure lies beside the project's code, so the innermost place that is named there is its caller's.
    assert job["error"]["kind"] == "InternalError"
    assert job["error"]["message"].startswith("ValueError: boom (procedures/inspection.py, line ")
    assert job["attempt"] == 1
    assert any("ValueError: boom (" in record.getMessage() for record in caplog.records)
    assert f'{Path(__file__).name}", line {analyse_to_boom.__code__.co_firstlineno + 1}' in caplog.text


def test_a_record_of_the_unit_that_cannot_be_stored_is_not_tried_again(client: Client) -> None:
    job = ended(client, "learns_nan")
    assert (job["state"], job["attempt"], job["error"]["kind"]) == ("failed", 1, "UnfitValue")
    assert "cannot be stored" in job["error"]["message"]


@pytest.mark.parametrize(("procedure", "sentence"), REFUSED_PLANS.items(), ids=REFUSED_PLANS)
@pytest.mark.parametrize("path", ["/api/v1/procedures/{}/preview", "/api/v1/jobs"], ids=["preview", "job"])
def test_a_plan_that_cannot_be_is_refused_before_anything_moves(
    client: Client, path: str, procedure: str, sentence: str
) -> None:
    before = client.stored()
    body = {"unit": "SIM-0001"} | ({"procedure": procedure} if path.endswith("jobs") else {})
    answer = client.http.post(path.format(procedure), json=body)
    assert (answer.status_code, answer.json()["type"]) == (422, "/problems/ProcedureDefect")
    assert answer.json()["detail"].startswith(sentence)
    if sentence.endswith("("):  # the place: this procedure lies beside the project's code, so its caller's
        assert "(bench_service/jobs/procedure_calls.py, line " in answer.json()["detail"]
    assert client.stored() == before


@pytest.mark.parametrize("function", ["planned_checks", "expected_averaging_time"])
def test_a_campaign_with_a_procedure_that_fails_in_planning_is_refused(client: Client, function: str) -> None:
    only = [{"name": "only", "procedure": f"{function}_raises"}]
    answer = client.http.post("/api/v1/campaigns", json={"name": "defective", "steps": only})
    assert (answer.status_code, answer.json()["type"]) == (422, "/problems/ProcedureDefect")
    assert f"`{function}` of procedure {function}_raises failed: KeyError: 'limit' (" in answer.json()["detail"]


def test_a_result_whose_report_cannot_be_made_is_shown_without_it(client: Client) -> None:
    result = ended(client, "unreported")["result"]
    report = client.http.get(f"/api/v1/results/{result}/report").json()
    assert report["summary"].startswith("unreported made no report of this result: IndexError: no row (")
    page = client.http.get(f"/results/{result}")
    assert page.status_code == 200
    assert "IndexError: no row" in page.text


def test_broken_files_are_left_out_and_named_and_the_others_serve(client: Client) -> None:
    names = {entry["name"] for entry in client.http.get("/api/v1/procedures").json()}
    assert {"sound", "no_operation", "static_run"} <= names
    assert not names & BROKEN.keys()
    ready = client.http.get("/readyz").json()
    notes = {note.split(" is left out: ")[0]: note for note in ready["notes"]}
    assert set(notes) == {f"procedures/catalog/{name}.py" for name in BROKEN}
    expected = {
        "half_written": "SyntaxError: '(' was never closed (broken_catalogue/half_written.py, line 1)",
        "misnamed": "PROCEDURE.name is 'no_operation', not the file's name",
        "nameless": "there is no PROCEDURE, which must be a Procedure",
        "raising": "ZeroDivisionError: division by zero",
        "script": "ImportError: broken_catalogue.script: importing it ends the program with SystemExit(3)",
    }
    for name, sentence in expected.items():
        assert sentence in notes[f"procedures/catalog/{name}.py"]
        asked = client.http.get(f"/api/v1/procedures/{name}")
        assert asked.status_code == 404
        assert sentence in asked.json()["detail"]
