"""Searches of jobs, recordings and results find what a plain loop over everything finds, on both databases."""

from collections.abc import Callable
from datetime import UTC, datetime, timedelta
from typing import Any
from uuid import UUID

import numpy as np
import pytest

from bench_service.campaigns.stores import Stores
from bench_service.model.batches import Selection
from bench_service.model.job import Job
from bench_service.model.records import NewRecording, StoredResult
from bench_service.model.search import LabelSought, Search
from bench_service.persistence import text_search
from bench_service.persistence.tables.columns import KEY_LENGTH
from bench_service.wall_clock import new_id
from procedures.core.limits import Verdict
from procedures.core.recording import RawArray, Station

START = datetime(2031, 3, 1, tzinfo=UTC)
LABELS: tuple[dict[str, str], ...] = (
    {"lot": "7", "customer": "Пилот"},
    {"lot": "70"},
    {},
    {'odd "name"': "50% off_", "lot": "8"},
    {"customer": "pilot"},
    {"7": "lot"},
)
TEXTS = ("PILOT", "Пил", "50% o", "_", "%", '"', "lot", "gyro", "u-2", "\\", "seven")


def id_at(moment: datetime) -> str:
    """A new id as it would have been made at a moment: its first 48 bits are the milliseconds."""
    milliseconds = int(moment.timestamp() * 1000)
    return str(UUID(int=milliseconds << 80 | UUID(new_id()).int & (2**80 - 1)))


@pytest.fixture
def jobs(stores: Stores, new_job: Callable[..., Job]) -> list[Job]:
    verdicts = (None, Verdict.PASS, Verdict.FAIL)
    return [
        stores.jobs.add(
            new_job(
                id=id_at(START + timedelta(days=i)),
                created_at=START + timedelta(days=i),
                unit=f"U-{i % 4}",
                bench="north" if i % 2 else "south",
                labels=LABELS[i % len(LABELS)],
                verdict=verdicts[i % 3],
                requested_by="gyro group" if i == 5 else "",
            )
        )
        for i in range(12)
    ]


def has(labels: dict[str, str], sought: LabelSought) -> bool:
    return sought.name in labels and sought.value in (None, labels[sought.name])


def low(text: str) -> str:
    """Only the capital letters of ASCII made small: what both databases agree on."""
    return "".join(c.lower() if c.isascii() else c for c in text)


def holds(text: str, values: list[str | None]) -> bool:
    return any(low(text) in low(value) for value in values if value is not None)


@pytest.mark.parametrize(
    "label",
    [
        "lot",
        "lot=7",
        "lot=70",
        "lot=",
        'odd "name"',
        'odd "name"=50% off_',
        "7",
        "customer=Пилот",
        "nothing",
        "lot=7=7",
    ],
)
def test_jobs_are_found_by_label(stores: Stores, jobs: list[Job], label: str) -> None:
    sought = LabelSought.parse(label)
    found = stores.jobs.list(search=Search(labels=(sought,))).items
    assert [job.id for job in found] == [job.id for job in jobs[::-1] if has(job.labels, sought)]


def test_several_labels_must_all_hold(stores: Stores, jobs: list[Job]) -> None:
    both = Search(labels=(LabelSought("lot", "7"), LabelSought("customer")))
    assert [job.id for job in stores.jobs.list(search=both).items] == [jobs[6].id, jobs[0].id]


@pytest.mark.parametrize("few", [False, True])
@pytest.mark.parametrize("text", TEXTS)
def test_jobs_are_found_by_text(
    stores: Stores, jobs: list[Job], text: str, few: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    if few:  # more different values than are gone through one by one: found all the same
        for bound in ("MOST", "LISTED", "LABEL_NAMES"):
            monkeypatch.setattr(text_search, bound, 1)

    def texts(job: Job) -> list[str | None]:
        return [job.id, job.procedure, job.unit, job.bench, job.requested_by, *job.labels, *job.labels.values()]

    wanted = [job.id for job in jobs[::-1] if holds(text, texts(job))]
    assert [job.id for job in stores.jobs.list(search=Search(text=text)).items] == wanted


def test_a_job_is_found_by_its_id_and_by_a_part_of_it(stores: Stores, jobs: list[Job]) -> None:
    def found(text: str) -> list[str]:
        return [job.id for job in stores.jobs.list(search=Search(text=text)).items]

    for job in jobs:
        for part in (job.id, job.id.upper(), job.id[-6:], job.id[14:23], job.id[:8]):
            assert found(part) == [other.id for other in jobs[::-1] if part.lower() in other.id]
    assert found(jobs[0].id + "0") == found("nothing") == []


def test_a_text_goes_on_from_page_to_page(stores: Stores, jobs: list[Job]) -> None:
    seen, cursor = [], None
    while True:
        page = stores.jobs.list(search=Search(text="ot"), bench="south", after=cursor, limit=2)
        seen += [job.id for job in page.items]
        if (cursor := page.next) is None:
            break
    labelled = [job for job in jobs if any("ot" in part.lower() for pair in job.labels.items() for part in pair)]
    assert seen == [job.id for job in labelled[::-1] if job.bench == "south"]
    assert len(seen) > 2


def test_a_search_goes_on_from_page_to_page(stores: Stores, jobs: list[Job]) -> None:
    search = Search(verdict=Verdict.FAIL)
    seen, cursor = [], None
    while True:
        page = stores.jobs.list(search=search, after=cursor, limit=3)
        seen += [job.id for job in page.items]
        if (cursor := page.next) is None:
            break
    assert seen == [job.id for job in jobs[::-1] if job.verdict is Verdict.FAIL]
    assert len(seen) == 4
    assert [job.id for job in stores.jobs.list(search=search, bench="north").items] == [jobs[11].id, jobs[5].id]


@pytest.mark.parametrize(
    ("since", "until"), [(0, 12), (3, 3), (3, 4), (2.5, 7.5), (-10, 1), (11, 99), (None, 5), (5, None), (20, 30)]
)
def test_jobs_are_found_by_the_moment_of_their_making(
    stores: Stores, jobs: list[Job], since: float | None, until: float | None
) -> None:
    first, last = (
        START + timedelta(days=d) for d in (-100 if since is None else since, 100 if until is None else until)
    )
    given = {n: m for n, m, d in (("since", first, since), ("until", last, until)) if d is not None}
    wanted = [job.id for job in jobs[::-1] if first <= job.created_at < last]
    assert [job.id for job in stores.jobs.list(search=Search(**given)).items] == wanted


def test_the_ends_of_the_calendar_are_moments_too(stores: Stores, jobs: list[Job]) -> None:
    ends = [moment.replace(tzinfo=UTC) for moment in (datetime.min, datetime.max)]
    assert len(stores.jobs.list(search=Search(since=ends[0], until=ends[1])).items) == len(jobs)


def test_recordings_have_labels_and_verdict_of_their_job(
    stores: Stores, jobs: list[Job], new_recording: Callable[..., NewRecording], samples: Callable[..., RawArray]
) -> None:
    def store(**given: Any) -> str:
        writer = stores.recordings.open(new_recording(**given))
        writer.write(samples(3))
        return writer.seal().id

    made = [store(job_id=job.id, bench=job.bench, station=Station(0, f"orientation {i}")) for i, job in enumerate(jobs)]
    files = [{"name": "Drive_2.csv", "sha256": "ab"}, {"name": "пилот.bin", "sha256": "cd"}]
    imported = store(unit="CAR", simulated=False, source={"files": files, "clock": {"name": "nothing"}})

    def found(**given: Any) -> list[str]:
        search = {n: given.pop(n) for n in ("simulated", "job_id") if n in given}
        shown = [r.info.id for r in stores.recordings.list(search=Search(**given), **search).items]
        selected = stores.batches.select(Selection(search=Search(**given), **search), 100)
        assert [recording for recording, _, _ in selected] == shown[::-1]  # a batch takes what the list shows
        return shown

    assert found(verdict=Verdict.FAIL) == [made[i] for i in (11, 8, 5, 2)]
    assert found(labels=(LabelSought("lot", "70"),)) == [made[7], made[1]]
    assert found(text="orientation 11") == [made[11]]
    assert found(text="пилот.b") == [imported]
    assert found(text="drive_2") == found(simulated=False) == found(text="car") == [imported]
    assert found(text="sha256") == found(text="nothing") == []
    by_chance = [i for i, job in enumerate(jobs) if "70" in made[i] or "70" in job.id]  # ids are searched, too
    assert found(text="70") == [imported] * ("70" in imported) + [made[i] for i in sorted({1, 7, *by_chance})[::-1]]


def test_names_and_labels_of_any_length_are_stored_and_found(
    stores: Stores, new_recording: Callable[..., NewRecording], samples: Callable[..., RawArray]
) -> None:
    """Random letters, which Postgres cannot compress to the 2704 bytes that a key of an index may have."""
    letters = np.random.Generator(np.random.PCG64(7))

    def store(**given: Any) -> str:
        writer = stores.recordings.open(new_recording(**given))
        writer.write(samples(3))
        return writer.seal().id

    def long(end: str, size: int) -> str:
        return "".join(chr(code) for code in letters.integers(0x410, 0x450, size)) + end

    files = [{"name": long(f".Drive_{number}", 240)} for number in range(64)]
    made = {
        "drive_63": store(source={"files": files}),
        "drive_a": store(source={"files": [{"name": long("Drive_A", KEY_LENGTH - 7)}]}),
        "drive_b": store(source={"files": [{"name": long("Drive_B", KEY_LENGTH - 6)}]}),
        "station_x": store(station=Station(0, long("Station_X", 4000))),
        "station_y": store(station=Station(0, long("Station_Y", KEY_LENGTH - 9))),
    }
    for text, recording in made.items():
        assert [one.info.id for one in stores.recordings.list(search=Search(text=text)).items] == [recording], text


def test_results_have_labels_of_their_job(
    stores: Stores, jobs: list[Job], new_result: Callable[..., StoredResult]
) -> None:
    made = [stores.results.add(new_result(job_id=job.id, verdict=job.verdict or Verdict.ERROR)).id for job in jobs]
    alone = stores.results.add(new_result(name="allan_deviation", kind="method", unit=None)).id

    def found(**given: Any) -> list[str]:
        name = given.pop("name", None)
        return [r.id for r in stores.results.list(search=Search(**given), name=name).items]

    assert found(labels=(LabelSought("lot", "7"),)) == [made[6], made[0]]
    assert found(verdict=Verdict.ERROR) == [made[i] for i in (9, 6, 3, 0)]
    assert found(text="ALLAN") == found(name="allan_deviation") == [alone]
    assert found(text="off_") == [made[9], made[3]]
