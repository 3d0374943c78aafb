"""Time that whole turns take over a wire: it is in the plan of recordings, and refused where it is too long."""

from pathlib import Path

import pytest

from bench_service.drivers.bench_file.description import described
from bench_service.drivers.bench_file.document import read_bench_file
from procedures.catalog import discover
from procedures.core.errors import BadParameter
from procedures.core.unit import Unit
from procedures.procedure import Context
from simulators.truth import declared_unit, default_unit

AXIS = "minimum_deg = -400, maximum_deg = 400, rate_deg_s = 60, acceleration_deg_s2 = 100"
FILE = f"""
[bench]
id = "east"
[site]
latitude_deg = 50.45
gravity_m_s2 = 9.810553
[turntable]
driver = "acutrol"
address = "tcp://127.0.0.1:9878"
outer = {{{{ number = 1, {AXIS}, continuous = true }}}}
middle = {{{{ number = 2, {AXIS} }}}}
inner = {{{{ number = 3, {AXIS} }}}}
[supply]
driver = "scpi"
address = "tcp://127.0.0.1:5025"
limits = {{{{ maximum_v = 36.0, maximum_a = 5.0, nominal_v = 28.0, nominal_a = 3.0 }}}}
[unit_link]
driver = "ixcom"
address = "tcp://127.0.0.1:3000"
[simulation]
time_factor = {{}}
"""
TURNS = discover()["scale_factor_whole_turns"]


def _context(folder: Path, factor: float) -> Context:
    path = folder / "east.toml"
    path.write_text(FILE.format(factor))
    unit: Unit = declared_unit(default_unit())
    return Context(unit, described(read_bench_file(path), None))


def test_recordings_of_turns_are_longer_by_the_tables_demands(tmp_path: Path) -> None:
    """Eight statements of 0.3 s with answers of 0.04 s, half a second of readings, and three bench seconds."""
    for factor in (1.0, 4.0):
        extra_s = factor * (8 * 0.34 + 0.5) + 3.0
        context = _context(tmp_path, factor)
        assert context.bench.turn_extra_s == pytest.approx(extra_s)
        station = TURNS.schedule(TURNS.resolve(TURNS.params(), context))[0]
        assert station.turn is not None
        assert station.record_s - station.turn.duration_s == pytest.approx(2.0 + extra_s, abs=0.1)
        with pytest.raises(BadParameter, match="which the demands of the table of bench east take"):
            TURNS.predict(TURNS.params(rest_s=extra_s - 0.5), context)


def test_a_time_factor_that_is_too_large_is_refused_with_the_largest_that_is_not(tmp_path: Path) -> None:
    with pytest.raises(
        BadParameter, match=r"time_factor = 40: whole turns would take 132 s .* at most 17\.7 lets them run"
    ):
        TURNS.predict(TURNS.params(), _context(tmp_path, 40.0))
    assert _context(tmp_path, 17.7).bench.no_turns == ""
