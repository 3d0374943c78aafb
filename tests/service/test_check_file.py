"""``bench check-file``: devices as they answer, and everything that is refused; nothing is commanded."""

from collections.abc import Generator
from pathlib import Path

import pytest

from bench_service.cli.commands import run_command_line
from bench_service.drivers.interface import registry
from bench_service.settings import Settings
from tests.kit import line_devices
from tests.kit.line_devices import LineDevice, bench_text, served

Served = tuple[Path, LineDevice, LineDevice, LineDevice]


@pytest.fixture
def east(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Generator[Served]:
    monkeypatch.setattr(registry, "SHIPPED", line_devices.SHIPPED)
    devices = line_devices.table(), line_devices.supply(), line_devices.chamber()
    with served(*devices):
        path = tmp_path / "east.toml"
        path.write_text(bench_text(*devices))
        yield path, *devices


def _run(path: Path, *more: str) -> int:
    return run_command_line(Settings(), ["check-file", str(path), *more])


def test_identities_limits_and_readings_are_shown_and_nothing_is_commanded(
    east: Served, capsys: pytest.CaptureFixture[str]
) -> None:
    path, table, supply, chamber = east
    table.state["limits"] = {"outer.rate_deg_s": 30.0}
    table.state["word"] = "0x41"
    code = _run(path, "--connect")
    shown = capsys.readouterr().out
    assert "bench east: mixed" in shown
    assert f"turntable: line at tcp://127.0.0.1:{table.port}: Line T3, serial T-7, firmware 1.2; status = 0x41" in shown
    assert "limit: turntable.outer.rate_deg_s: the file has 60, the device 30; 30 holds" in shown
    assert "unit link: simulated" in shown
    assert "refused" not in shown, "a simulated unit stands in the real chamber's air"
    assert code == 0
    assert [d.demands() for d in (table, supply, chamber)] == [[], [], []]


def test_a_device_that_does_not_answer_is_refused_with_its_address(
    east: Served, capsys: pytest.CaptureFixture[str]
) -> None:
    path, _, supply, _ = east
    supply.silent = True
    assert _run(path, "--connect") == 1
    shown = capsys.readouterr().out
    assert f"supply: line at tcp://127.0.0.1:{supply.port}: does not answer" in shown
    assert f"refused: the supply: tcp://127.0.0.1:{supply.port} does not answer" in shown
    supply.silent = False


@pytest.mark.parametrize(("policy", "word", "code"), [("refuse", "refused", 1), ("warn", "warning", 0)])
def test_an_overdue_certificate_is_refused_or_warned_of(
    east: Served, capsys: pytest.CaptureFixture[str], policy: str, word: str, code: int
) -> None:
    path, *_ = east
    text = path.read_text().partition("[chamber]")[0]
    certificate = 'certificate = { number = "G-1", due = 2020-01-31 }\n'
    path.write_text(
        text.replace("[site]\n", f"[site]\n{certificate}") + f'[policy]\nexpired_certificate = "{policy}"\n'
    )
    assert _run(path) == code
    assert (
        f"{word}: the certificate G-1 of the site has expired: it was valid until 2020-01-31" in capsys.readouterr().out
    )


def test_a_file_that_cannot_be_read_is_one_line(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = tmp_path / "east.toml"
    path.write_text("[bench]\nid = east\n")
    assert _run(path) == 2
    said = capsys.readouterr()
    assert said.out == ""
    assert said.err.startswith(f"bench: {path}: ")
    assert "line 2" in said.err
