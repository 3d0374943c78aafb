"""Table programs: the thesis's own text is read, programs written are read back, other lines are refused by number."""

import json
import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from procedures.analysis.table_program.dialect import AXES, DELAY_MAX_S, DWELLS_MAX, Dwell, read_program
from procedures.analysis.table_program.writing import THESIS_POSITIONS, dwells_at, write_program
from procedures.catalog import discover
from procedures.core.errors import BadParameter, UnfitRecording
from procedures.core.limits import Verdict
from procedures.core.recording import Channel, MemoryRecording, Quantity, Recording, RecordingInfo, Station
from procedures.core.table_angles import TableAngles
from procedures.procedure import Context
from tests.kit.forward_model import turn
from tests.kit.table_programs import APPENDIX, HOME

PROCEDURE = discover()["table_program"]


def moves(dwells: tuple[Dwell, ...]) -> list[list[float]]:
    return [[d.angles.outer_deg, d.angles.middle_deg, d.angles.inner_deg, d.delay_s] for d in dwells]


def printed(dwells: tuple[Dwell, ...]) -> list[list[float]]:
    """In the order of a program's axes 1, 2, 3."""
    return [[d.angles.inner_deg, d.angles.middle_deg, d.angles.outer_deg, d.delay_s] for d in dwells]


def test_the_appendix_is_read_as_it_is_printed():
    dwells = read_program(APPENDIX)
    demands = re.findall(r"1, ?([-\d]+); p 2,([-\d]+); p 3,([-\d]+)\ndelay (\d+)", APPENDIX)
    assert printed(dwells) == [[float(number) for number in demand] for demand in demands]
    assert moves(dwells) == [list(p) for p in THESIS_POSITIONS]
    assert len(dwells) == 16
    assert APPENDIX.split("\n")[dwells[6].line - 1] == "delay 60"
    assert read_program(APPENDIX.replace("\n", "\r\n")) == dwells


@pytest.mark.shared_data
def test_the_appendix_holds_the_facts_moves(shared_data: Path):
    facts = json.loads((shared_data.parent / "facts" / "thesis.json").read_text())["appendix_table_program"]
    assert printed(read_program(APPENDIX)) == facts["moves"]
    assert tuple(facts["axes"].items()) == tuple(zip("123", AXES, strict=True))


def test_the_appendix_is_a_calibration_only_with_its_axes_in_this_order():
    """Twelve numbers of a triad from [1, v] at the fourteen rests, v in the unit's axes, by matrices written out here.

    The outer axis is vertical, which is y of the unit at zero; the Earth's rate points north and up at 50°. With axes 1
    and 3 swapped gravity has rank 3, because turning about the vertical does not change it.
    """

    def design(rows: list[list[float]], about_up: int, field: list[float]) -> np.ndarray:
        found: list[np.ndarray] = []
        for row in rows:
            attitude = turn("y", row[about_up]) @ turn("z", row[1]) @ turn("x", row[2 - about_up])
            found.append(np.array([1.0, *(attitude.T @ np.array(field))]))
        return np.array(found)

    rests = printed(read_program(APPENDIX))[1:-1]
    assert len(rests) == 14
    gravity, rate = [0.0, 1.0, 0.0], [np.cos(np.radians(50.0)), np.sin(np.radians(50.0)), 0.0]
    for field, condition in ((gravity, 1.28), (rate, 1.35)):  # with columns scaled to unit length
        rows = design(rests, 2, field)
        assert np.linalg.matrix_rank(rows) == 4
        assert np.linalg.cond(rows / np.linalg.norm(rows, axis=0)) == pytest.approx(condition, abs=0.005)
    assert np.linalg.matrix_rank(design(rests, 0, gravity)) == 3


angles = st.floats(-3600.0, 3600.0, allow_nan=False)
delays = st.floats(0.0, DELAY_MAX_S, exclude_min=True, allow_nan=False)


@given(st.lists(st.tuples(angles, angles, angles, delays), min_size=1, max_size=8))
def test_what_is_written_is_read_back_to_the_last_digit(positions: list[tuple[float, float, float, float]]):
    read = read_program(write_program(dwells_at(positions)))
    assert moves(read) == [list(p) for p in positions]
    assert moves(read_program(write_program(read))) == moves(read)


def test_axes_that_a_demand_does_not_name_stay_and_small_things_do_not_matter():
    program = (
        HOME + "  :DEMAND:Position  2, -90.5 ; P 1,+.5  % half\n\n:demand:position 3,7.\n\tDelay 1.5\ndelay 2 % on"
    )
    assert printed(read_program(program)) == [[0, 0, 0, 10], [0.5, -90.5, 7, 1.5], [0.5, -90.5, 7, 2]]


@pytest.mark.parametrize(
    ("line", "expected"),
    [
        ("park", r"a comment \(%\), ':mode:position all', ':demand:position"),
        (":demand:rate 1,10", "':demand:position axis,degrees; p axis,degrees'"),
        ("* * * * *", "'delay seconds'"),
        ("% \x00", "printable text"),  # no database holds it, not even in a comment
        (":mode:position 1", "'all'"),
        (":mode:position", "'all'"),
        (":demand:position", r"an axis, 1 \(inner\), 2 \(middle\) or 3 \(outer\), not ''"),
        (":demand:position 4,10", "an axis, .* not '4'"),
        (":demand:position 1", "a comma and degrees after axis 1"),
        (":demand:position 1,ten", r"degrees of axis 1, within ±3600, not 'ten'"),
        (":demand:position 1,1e2", "degrees of axis 1"),
        (":demand:position 1,nan", "degrees of axis 1"),
        (":demand:position 1,٣", "degrees of axis 1"),
        (":demand:position 1,3601", "within ±3600, not '3601'"),
        (":demand:position 1,10; 2,10", "'p axis,degrees' after ';', not '2,10'"),
        (":demand:position 1,10;", "'p axis,degrees' after ';', not ''"),
        (":demand:position 1,10; p 1,20", "'delay seconds' first: axis 1 was demanded in this line already"),
        (":demand:position 1 10", "an axis, .* not '1 10'"),
        ("delay", "seconds, above 0 and at most 86400, not ''"),
        ("delay 0", "seconds, above 0"),
        ("delay -5", "seconds, above 0"),
        ("delay 60 s", "not '60 s'"),
        ("delay 100000", "at most 86400"),
    ],
)
def test_a_line_outside_the_dialect_is_refused_with_its_number_and_what_was_expected(line: str, expected: str):
    with pytest.raises(BadParameter, match=f"line 4: expected .*{expected}") as refusal:
        read_program("% a program\n" + HOME + line + "\n" + HOME)
    assert (refusal.value.field, refusal.value.value) == ("program", line)


@pytest.mark.parametrize(
    ("program", "message"),
    [
        ("", "line 1: expected 'delay seconds': the program has no dwell"),
        ("% nothing\n:mode:position all\n", "no dwell"),
        ("delay 5\n", "line 1: expected ':demand:position' of axis 1, 2, 3 first"),
        (":demand:position 1,5; p 3,5\ndelay 5\n", "line 2: expected ':demand:position' of axis 2 first"),
        (":demand:position 1,5\n:demand:position 1,6\n", "line 2: .*first: axis 1 was demanded in line 1 already"),
        (HOME + ":demand:position 1,5\n% end\n", "line 3: expected 'delay seconds' after this demand"),
        (HOME + "delay 1\n" * DWELLS_MAX, f"line {DWELLS_MAX + 2}: expected no more: 500 delays"),
    ],
)
def test_a_program_that_leaves_something_open_is_refused(program: str, message: str):
    with pytest.raises(BadParameter, match=message):
        read_program(program)


def test_a_refusal_repeats_a_bounded_piece_of_a_line():
    with pytest.raises(BadParameter) as refusal:
        read_program("x" * 10_000)
    assert len(str(refusal.value)) < 400


def planned(context: Context, **given_parameters: object) -> tuple[Station, ...]:
    return PROCEDURE.schedule(PROCEDURE.resolve(PROCEDURE.params(**given_parameters), context))


def test_a_delay_holds_moving_and_settling_as_on_the_controller(context: Context):
    """Axes of 60 deg/s and 60 deg/s²: 135° take 135/60 + 1 s, 180° take 4 s, nothing takes nothing."""
    stations = planned(context)
    assert [s.angles for s in stations] == [TableAngles(*p[:3]) for p in THESIS_POSITIONS]
    assert [s.record_s for s in stations[:3]] == pytest.approx([10 - 2, 96.7, 60 - 4 - 2])  # 102 − 3.25 − 2 = 96.75
    assert [s.index for s in stations] == list(range(16))
    assert stations[1].label == "line 8: outer=-9 middle=90 inner=135"
    resting = planned(context, delay_from="rest")
    assert [s.record_s for s in resting] == [p[3] for p in THESIS_POSITIONS]


def test_positions_are_written_as_a_program(context: Context):
    params = PROCEDURE.resolve(PROCEDURE.params(positions=((10.0, 20.5, -30.0, 40.0),)), context)
    assert params.positions is None
    assert ":demand:position 1,-30; p 2,20.5; p 3,10\ndelay 40\n" in params.program
    assert PROCEDURE.params.model_validate_json(params.model_dump_json()) == params
    assert PROCEDURE.resolve(params, context) == params
    with pytest.raises(BadParameter, match="not together with a program"):
        PROCEDURE.resolve(PROCEDURE.params(program=HOME, positions=((0.0, 0.0, 0.0, 5.0),)), context)


def test_a_delay_that_moving_uses_up_is_refused_by_its_line(context: Context):
    program = HOME + ":demand:position 1,180\ndelay 6\n"
    with pytest.raises(BadParameter, match=r"line 4: expected a delay of at least 7 s.*take 6 s"):
        planned(context, program=program)
    assert planned(context, program=program, settle_s=0.5)[1].record_s == pytest.approx(1.5)
    with pytest.raises(BadParameter, match=r"line 2: expected a delay of at least 1 s"):
        planned(context, program=HOME.replace("10", "0.5"), delay_from="rest")


def recorded(stations: tuple[Station, ...], channels: tuple[Channel, ...], short: int = 0) -> list[Recording]:
    """400 Hz; channel c of dwell i is 1000·i + c, with an alternating ripple of one millionth."""
    found: list[Recording] = []
    start = 3.0
    for i, s in enumerate(stations):
        count = round(400 * s.record_s) - (short if i == 1 else 0)
        ripple = np.where(np.arange(count) % 2, 1e-6, -1e-6)[:, None]
        raw = ripple + 1000.0 * i + np.arange(len(channels))
        found.append(MemoryRecording(RecordingInfo(f"r{i}", "S-1", channels, 400.0, count, start, s), raw))
        start += s.record_s + 5.0
    return found


def test_means_of_every_channel_with_what_is_known_of_their_noise(context: Context):
    params = PROCEDURE.resolve(PROCEDURE.params(program=HOME + ":demand:position 1,90\ndelay 15\n"), context)
    stations = PROCEDURE.schedule(params)
    channels = (*context.unit.channels, Channel("temperature", Quantity.TEMPERATURE, "degC"))
    result = PROCEDURE.analyse(recorded(stations, channels), params, context)
    assert result.verdict is Verdict.PASS
    assert [d.samples_recorded for d in result.dwells] == [3200, 4200]  # 15 − 2 − 2.5 s
    assert [m.mean for m in result.dwells[1].means] == pytest.approx([1000.0 + c for c in range(7)])
    gyro, temperature = result.dwells[0].means[0], result.dwells[0].means[6]
    noise = context.unit.gyro.noise[0]
    white = np.sqrt(noise.random_walk**2 / 8.0 + 2.0 * (noise.quantization / 8.0) ** 2)  # 8 s recorded
    assert white < gyro.standard_uncertainty < 2.0 * white  # and a little flicker
    assert (gyro.from_noise, temperature.from_noise) == (True, False)
    assert temperature.standard_uncertainty == pytest.approx(0.0, abs=1e-9)  # the ripple has no mean over a batch
    assert any("temperature" in w for w in result.warnings)
    assert printed(read_program(result.program)) == [[0, 0, 0, 10], [90, 0, 0, 15]]
    assert PROCEDURE.result.model_validate_json(result.model_dump_json()) == result
    assert len(PROCEDURE.report(result).sections) == 3
    prediction = PROCEDURE.predict(params, context)
    assert len(prediction.uncertainties) == 6
    assert prediction.uncertainties[0].standard_uncertainty == pytest.approx(gyro.standard_uncertainty, rel=0.01)
    assert prediction.duration_s == pytest.approx(25.0)  # the delays and nothing else


def test_a_dwell_cut_short_fails_and_another_programs_recordings_are_refused(context: Context):
    params = PROCEDURE.resolve(PROCEDURE.params(program=HOME * 2), context)
    stations = PROCEDURE.schedule(params)
    result = PROCEDURE.analyse(recorded(stations, context.unit.channels, short=1), params, context)
    assert result.verdict is Verdict.FAIL
    assert [c.passed for c in result.checks] == [True, False]
    whole = recorded(stations, context.unit.channels)
    with pytest.raises(UnfitRecording, match=re.escape("dwell 2 of the program")):
        PROCEDURE.analyse(whole[:1], params, context)
    with pytest.raises(UnfitRecording, match="another place or length"):
        PROCEDURE.analyse(whole, params.model_copy(update={"settle_s": 3.0}), context)
    with pytest.raises(UnfitRecording, match="2 recordings for the program's 1 dwells"):
        PROCEDURE.analyse(whole, params.model_copy(update={"program": HOME}), context)
    unknown = PROCEDURE.analyse(whole, params, replace(context, unit=replace(context.unit, gyro=None)))
    assert [m.from_noise for m in unknown.dwells[0].means] == [False] * 3 + [True] * 3
