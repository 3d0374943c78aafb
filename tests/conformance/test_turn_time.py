"""Time that whole turns take over a wire: it is in the plan of recordings, and refused where it is too long."""

from dataclasses import replace
from pathlib import Path

import pytest

from bench_service.drivers.bench_file.description import _no_turns, described
from bench_service.drivers.bench_file.document import read_bench_file
from bench_service.drivers.interface.sections import TurntableSection
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


def _context(folder: Path, factor: float, pause: str = "") -> Context:
    path = folder / "east.toml"
    path.write_text(FILE.format(factor).replace("[supply]", f"{pause}\n[supply]"))
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


PAUSE = "turntable.after_demand_s"
TAKES_LONG = "whole turns would take {} s of bench time for the table's demands alone, more than 60 s; {}"
FAST = "lets them run, where the controller takes demands so fast"


@pytest.mark.parametrize(
    ("factor", "pause_s", "cause", "seconds", "way_out"),
    [
        # factor·(8·(pause + 0.04 s) + 0.5 s) + 3 s is just below 60 s at 7.02 s, at 3.46 s, and at a factor of 69.5.
        (1.0, 7.2, f"{PAUSE} = 7.2", 61, f"{PAUSE} of at most 7 s {FAST}"),
        (2.0, 7.2, "simulation.time_factor = 2", 120, f"{PAUSE} of at most 3.4 s {FAST}"),
        (200.0, 0.0, "simulation.time_factor = 200", 167, "a factor of at most 69.5 lets them run"),
    ],
)
def test_a_way_out_is_one_that_works(
    tmp_path: Path, factor: float, pause_s: float, cause: str, seconds: int, way_out: str
) -> None:
    """Real devices run at a factor of 1 alone: the pause after a demand is what can be shortened there."""
    reason = _context(tmp_path, factor, f"after_demand_s = {pause_s}").bench.no_turns
    assert reason == f"{cause}: " + TAKES_LONG.format(seconds, way_out)


def test_no_way_out_is_named_where_there_is_none(tmp_path: Path) -> None:
    """A driver without the setting, whose demands take 100 s at any factor."""

    class SlowTable(TurntableSection):
        def turn_extra_s(self, factor: float) -> float:
            return 100.0

    (tmp_path / "east.toml").write_text(FILE.format(40.0))
    file = read_bench_file(tmp_path / "east.toml")
    slow = replace(file, devices={**file.devices, "turntable": SlowTable.model_construct(driver="slow")})
    assert _no_turns(slow, 100.0).endswith("more than 60 s")
