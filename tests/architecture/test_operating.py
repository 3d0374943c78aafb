"""The units of systemd and the settings of docs/operating.md hold: sections, commands, variables, metrics."""

import re
import shlex
from configparser import RawConfigParser
from pathlib import Path

import pytest

from bench_service.settings import Settings
from tests.kit.command_words import refused
from tests.kit.documents import ROOT, Block, blocks, texts_of_code

PAGE = ROOT / "docs" / "operating.md"
UNITS = [b for b in blocks(PAGE) if b.language == "ini" and b.text.startswith("[Unit]")]
SETTINGS = [b for b in blocks(PAGE) if b.language == "ini" and b.text.startswith("BENCH_")]
KEYS = {
    "Unit": {"Description", "After", "Wants"},
    "Service": {
        *("User", "WorkingDirectory", "EnvironmentFile", "ExecStart", "ExecStartPost", "Type", "Restart", "RestartSec"),
        *("TimeoutStopSec", "NoNewPrivileges", "ProtectSystem", "ReadWritePaths"),
    },
    "Timer": {"OnCalendar", "Persistent"},
    "Install": {"WantedBy"},
}


def test_the_page_has_the_units_of_a_service_a_supervisor_and_a_backup() -> None:
    assert [len(UNITS), len(SETTINGS)] == [4, 1]


@pytest.mark.parametrize("block", UNITS, ids=str)
def test_a_unit_has_keys_of_systemd_and_commands_of_bench(block: Block) -> None:
    unit = RawConfigParser(strict=True)
    unit.optionxform = str  # type: ignore[method-assign]
    unit.read_string(block.text)
    for section in unit.sections():
        assert set(unit[section]) <= KEYS[section]
    for command in re.findall(r"/opt/bench/\.venv/bin/bench ([^']+?)'?$", block.text, re.MULTILINE):
        assert refused(shlex.split(command.replace("$$(", "").replace(")", "").replace("date +", "date+"))) == ""


def test_the_settings_are_settings(tmp_path: Path) -> None:
    given = dict(line.split("=", 1) for line in SETTINGS[0].text.splitlines() if line)
    (tmp_path / "east.toml").write_text('[bench]\nid = "east"\n')
    settings = Settings.from_environ({**given, "BENCH_FILE": str(tmp_path / "east.toml")})
    assert (settings.bench_id, settings.log, settings.scrub_at) == ("east", "json", "03:30")


def test_the_metrics_are_metrics() -> None:
    named = set(re.findall(r"`(bench_\w+?)(?:_total)?`", PAGE.read_text(encoding="utf-8")))
    assert len(named) > 5
    assert {name for name in named if name not in texts_of_code().split("\n")} == set()
