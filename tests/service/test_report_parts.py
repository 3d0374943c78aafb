"""Parts of printed reports, and the process that prints them: conditions, instruments, a kill in the middle."""

import base64
import multiprocessing
import os
import signal
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from datetime import datetime
from pathlib import Path
from tempfile import gettempdir

import pytest

from bench_service.evidence.reports.condition_parts import conditions
from bench_service.evidence.reports.context_parts import instruments
from bench_service.evidence.reports.printing_process import open_printing
from bench_service.evidence.work_processes import WorkProcesses
from bench_service.formats.printed.document import Paragraph, PrintedDocument
from bench_service.formats.printed.typesetting import FOLDER, printable, typeset
from bench_service.model.errors import StorageFailure
from bench_service.model.records import RecordingState, StoredRecording
from bench_service.wall_clock import now, pause
from procedures.core.measured import Measured, MeasuredEnvironment, MeasuredSupply
from procedures.core.recording import RecordingInfo, Station
from procedures.core.temperature_profile import ProfileLeg, SoakCriterion, TemperatureProfile
from tests.kit.pdf_a import text_of
from tests.kit.printed_words import words_of


def test_a_killed_process_leaves_no_half_report_and_the_next_one_prints_the_same_bytes() -> None:
    """The process is killed while it typesets: the request is refused, its folder goes, the next one is whole."""
    document = PrintedDocument(
        "A", "B", "PASS", "c", now().replace(year=2026, microsecond=0), (Paragraph("#d *e* $f$"),)
    )
    endless = replace(document, blocks=tuple(Paragraph(f"paragraph {k}") for k in range(200_000)))
    processes = WorkProcesses(open_printing, at_once=1)
    try:
        with ThreadPoolExecutor(1) as pool:
            half = pool.submit(processes.result, "print", endless)
            folder = _folder_of_a_child()
            os.kill(int(folder.name.split("-")[2]), signal.SIGKILL)
            with pytest.raises(StorageFailure, match="try again"):
                half.result(timeout=60.0)
        found = base64.b64decode(processes.result("print", document))
        assert not folder.exists()
    finally:
        processes.close()
    assert found == typeset(document)
    assert "#d *e* $f$" in text_of(found), "text is no markup"


def _folder_of_a_child() -> Path:
    """The folder of the child process that prints now."""
    children: set[int] = set()
    for _ in range(6000):
        children |= {child.pid for child in multiprocessing.active_children() if child.pid}
        for folder in Path(gettempdir()).glob(f"{FOLDER}*-*"):
            if int(folder.name.split("-")[2]) in children:
                return folder
        pause(0.01)
    raise AssertionError("no process printed")


def test_what_a_pdf_a_may_not_hold_is_written_as_its_code() -> None:
    assert printable("a\x00b\u200bc漢\ue000√\nЇ") == "abc[U+6F22][U+E000]√\nЇ"


def test_conditions_are_those_of_chamber_room_and_supply() -> None:
    """Set points of a temperature profile in their order; the room's and the supply's readings as ranges."""
    legs = tuple(ProfileLeg(t, 1.0, 0.0, 60.0) for t in (20.0, -40.0, 60.0))
    run = Station(0, "x up", profile=TemperatureProfile(legs, SoakCriterion()))
    read = [
        Measured(
            supply=MeasuredSupply(28.0, current, 0.0, False, 3),
            environment=MeasuredEnvironment(temperature_c=21.5, humidity_percent=humidity),
        )
        for current, humidity in ((1.0, 40.0), (1.25, 45.0))
    ]
    infos = [RecordingInfo(f"r{k}", "U", (), 100.0, 1000, station=run, measured=m) for k, m in enumerate(read)]
    recordings = [StoredRecording(info, RecordingState.COMPLETE, now()) for info in infos]
    text = words_of(PrintedDocument("", "", "", "", now(), tuple(conditions({}, recordings))))
    for words in (
        "set points of the chamber 20, -40, 60 °C, in this order",
        "temperature of the room 21.5 °C",
        "humidity of the room 40 … 45 %",
        "air pressure not recorded",
        "supply, measured 28 V, 1 … 1.25 A",
        "recorded 2 recordings, 20 s in all",
    ):
        assert words in text, text


def test_an_instrument_whose_certificate_was_over_is_marked() -> None:
    device = {"name": "turntable", "simulated": False, "driver": "acutrol", "identity": None}
    certificate = {"number": "PTB 1", "laboratory": "PTB", "due": "2026-03-01"}
    context = {"bench": {"id": "b", "devices": [{**device, "certificate": certificate}]}}
    for at, due in (("2026-03-01T12:00:00+00:00", "2026-03-01"), ("2026-03-02T00:00:00+00:00", "2026-03-01, OVERDUE")):
        blocks = tuple(instruments(context, datetime.fromisoformat(at)))
        assert f"turntable acutrol – PTB 1 PTB {due}" in words_of(PrintedDocument("", "", "", "", now(), blocks))
