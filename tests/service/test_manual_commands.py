"""``bench manual`` from start to end, over HTTP."""

from collections.abc import Callable, Generator

import pytest

from bench_service.cli.commands import run_command_line
from bench_service.cli.options import console, errors
from bench_service.settings import Settings
from tests.kit.command_line import Done, one_line
from tests.kit.served import served

Bench = Callable[..., Done]


@pytest.fixture(scope="module")
def address(tmp_path_factory: pytest.TempPathFactory) -> Generator[str]:
    with served(tmp_path_factory.mktemp("served"), real_time_factor=50.0) as at:
        yield at


@pytest.fixture
def bench(address: str, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch) -> Bench:
    """``bench manual … --server address``."""
    for each in (console, errors):
        monkeypatch.setattr(each, "_width", 200)

    def run(*arguments: object) -> Done:
        capsys.readouterr()
        code = run_command_line(Settings.model_validate({}), ["manual", *map(str, arguments), "--server", address])
        printed = capsys.readouterr()
        return Done(code, printed.out, printed.err)

    return run


def test_manual_mode_from_start_to_end(bench: Bench) -> None:
    one_line(bench("home"), "is not in manual mode")
    assert "no process has its devices open" in bench("read").out
    assert "in manual mode by ann until" in bench("start", "--reason", "a look", "--by", "ann").out
    one_line(bench("start", "--reason", "me too", "--by", "bob"), "is in manual mode by ann")
    moved = bench("go", "--middle-deg", 20, "--by", "ann")
    assert (moved.code, moved.out) == (0, "go_to: done: at rest at 0.0000, 20.0000, 0.0000 deg\n")
    one_line(bench("go", "--middle-deg", 200, "--by", "ann"), "middle_deg", "-190 … 190")
    one_line(bench("home", "--by", "bob"), "only its holder may command")
    turning = bench("rate", "outer", 5, "--duration-s", 900, "--no-wait", "--by", "ann")
    assert (turning.code, turning.out.split(":")[1].strip()) == (0, "accepted")
    refused = bench("home", "--by", "ann")
    assert (refused.code, "halt it" in refused.out) == (1, True)
    assert bench("halt", "--by", "ann").out == "halt: done: the table rests\n"
    assert "on: 28.000 V" in bench("supply", "on", "--by", "ann").out
    assert bench("chamber", "30", "--by", "ann").out.startswith("chamber: done: commanded to 30 °C at ")
    one_line(bench("supply", "of", "--by", "ann"), "supply_of")
    shown = bench("read").out
    assert all(word in shown for word in ("outer angle", "middle rate", "set point", "supply voltage")), shown
    assert bench("read", "--json").json()["manual"]["holder"] == "ann"
    assert "ends at" in bench("renew", "--minutes", 30, "--by", "ann").out
    ended = bench("end", "--by", "bob")
    assert (ended.code, ended.out) == (0, "manual mode of bench sim is over, it is safe: ended by bob\n")
