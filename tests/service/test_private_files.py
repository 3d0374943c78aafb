"""Files of the service are for its own user alone; what a command exports has the rights of the user's files."""

import os
import stat
from collections.abc import Generator
from pathlib import Path

import pytest

from bench_service.cli.asking.client import connect
from bench_service.cli.files import whole_file
from bench_service.cli.processes import private_files
from bench_service.cli.processes.private_files import protect
from bench_service.settings import Settings


@pytest.fixture(autouse=True)
def open_umask(monkeypatch: pytest.MonkeyPatch) -> Generator[None]:
    """As most machines have it."""
    monkeypatch.setattr(private_files, "_given", [])
    before = os.umask(0o022)
    yield
    os.umask(before)


def rights(path: Path) -> int:
    return stat.S_IMODE(path.lstat().st_mode)


def test_everything_that_a_service_makes_is_private(tmp_path: Path) -> None:
    folder, devices = tmp_path / "data", tmp_path / "devices"
    settings = Settings(database_url=f"sqlite:///{folder / 'bench.sqlite'}", device_folder=devices)
    with connect(settings, None, drive=True) as http:
        job = http.post("/api/v1/jobs", json={"procedure": "no_operation", "unit": "SIM-0001"})
        assert job.status_code == 202
        http.post("/api/v1/benches/sim/stop").raise_for_status()
        made = [*folder.iterdir(), *devices.iterdir()]
        assert {"bench.sqlite", "bench.sqlite-wal"} <= {path.name for path in made}
        assert {path.name: oct(rights(path)) for path in made if rights(path) & 0o077} == {}
    assert (rights(folder), rights(devices)) == (0o700, 0o700)


def test_what_an_older_service_left_is_closed(tmp_path: Path) -> None:
    folder = tmp_path / ".bench"
    folder.mkdir(mode=0o755)
    names = (
        "bench.sqlite",
        "bench.sqlite-wal",
        "bench.sqlite.sim.jobs",
        "bench-sim.devices",
        "bench-sim.supervisor.log",
    )
    for name in names:
        (folder / name).write_bytes(b"")
        (folder / name).chmod(0o644)
    protect(Settings(database_url=f"sqlite:///{folder / 'bench.sqlite'}"))
    assert {rights(path) for path in folder.iterdir()} == {0o600}
    assert rights(folder) == 0o700


def test_a_folder_that_holds_other_things_stays_as_it_is(tmp_path: Path) -> None:
    home = tmp_path / "home"
    home.mkdir(mode=0o755)
    letter, database, elsewhere = home / "letter.txt", home / "bench.sqlite", tmp_path / "elsewhere"
    for file in (letter, database, elsewhere):
        file.write_text("x")
        file.chmod(0o644)
    (home / "bench-link").symlink_to(elsewhere)
    protect(Settings(database_url=f"sqlite:///{database}"))
    assert [rights(path) for path in (letter, database, elsewhere, home)] == [0o644, 0o600, 0o644, 0o755]
    protect(Settings(database_url=f"sqlite:///{tmp_path / 'nowhere' / 'bench.sqlite'}"))
    protect(Settings(database_url="postgresql+psycopg://u@h/d", device_folder=home))
    assert rights(letter) == 0o644


def test_an_export_has_the_rights_of_the_users_files(tmp_path: Path) -> None:
    protect(Settings(database_url=f"sqlite:///{tmp_path / 'bench.sqlite'}"))
    for umask, expected in ((0o022, 0o644), (0o027, 0o640)):
        private_files._given[:] = [umask]
        with whole_file(tmp_path / "part.csv") as sink:
            sink.write(b"1\n")
        assert rights(tmp_path / "part.csv") == expected
    private_files._given.clear()
    os.umask(0o026)
    with whole_file(tmp_path / "other.csv") as sink:
        sink.write(b"1\n")
    assert rights(tmp_path / "other.csv") == 0o640
