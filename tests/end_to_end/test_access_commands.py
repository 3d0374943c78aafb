"""`bench user`, `bench token` and `bench audit`: the owner of the files makes the first account and recovers it."""

import json
from collections.abc import Callable, Generator
from contextlib import nullcontext
from io import StringIO
from pathlib import Path

import pytest

from bench_service.cli.asking.client import connect
from bench_service.cli.commands import run_command_line
from bench_service.cli.groups import access as access_commands
from bench_service.cli.processes.serving import check_address
from bench_service.cli.refusal import Refused
from bench_service.settings import Settings
from tests.kit.people import PASSWORD, cheap_passwords

Run = Callable[..., tuple[int, str, str]]


@pytest.fixture
def settings(tmp_path: Path) -> Settings:
    return Settings(database_url=f"sqlite:///{tmp_path / 'bench.sqlite'}")


@pytest.fixture
def one_process(settings: Settings, monkeypatch: pytest.MonkeyPatch) -> Generator[None]:
    """One embedded service for all commands of a test: each would open its own."""
    with cheap_passwords(), connect(settings, None, drive=False) as client:
        monkeypatch.setattr(access_commands, "connect", lambda *_, **__: nullcontext(client))
        yield


@pytest.fixture
def run(settings: Settings, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch) -> Run:
    def command(*arguments: str, said: str = "") -> tuple[int, str, str]:
        monkeypatch.setattr("sys.stdin", StringIO(said))
        code = run_command_line(settings, list(arguments))
        return code, *capsys.readouterr()

    return command


@pytest.mark.usefixtures("one_process")
def test_accounts_and_tokens_from_the_command_line(run: Run, settings: Settings) -> None:
    anywhere = settings.model_copy(update={"host": "0.0.0.0"})
    with pytest.raises(Refused, match="bench user add"):
        check_address(anywhere)
    code, _, error = run("user", "add", "bo", "--role", "viewer", "--password-file", "-", said=f"{PASSWORD}\n")
    assert (code, "role admin" in error) == (2, True)
    code, out, _ = run("user", "add", "ada", "--role", "admin", "--password-file", "-", said=f"{PASSWORD}\n")
    assert (code, out) == (0, "account ada, admin\n")
    code, out, _ = run("audit", "close", "--before", "2000-01-01T00:00:00Z")
    assert (code, out) == (0, "no entry is that old\n")
    check_address(anywhere)  # there is somebody who can log in
    assert run("user", "add", "bo", "--role", "operator", "--team", "alpha", "--no-password")[0] == 0
    listed = json.loads(run("user", "list", "--json")[1])
    assert [(one["name"], one["team"], one["has_password"]) for one in listed] == [
        ("ada", "", True),
        ("bo", "alpha", False),
    ]
    code, token, notice = run("token", "add", "nightly", "--role", "engineer", "--days", "2")
    assert code == 0
    assert token.startswith("bench_")
    assert len(token.split()) == 1, "a script takes it from standard output"
    assert "not shown again" in " ".join(notice.split())
    assert token.strip() not in run("token", "list", "--json")[1]
    assert run("token", "revoke", "nightly")[0] == 0
    code, _, error = run("user", "set", "bo")
    assert (code, "--password" in error) == (2, True)
    assert run("user", "set", "ada", "--password-file", "-", said="another long password\n")[0] == 0
    code, _, error = run("user", "remove", "ada")
    assert (code, "last admin" in error) == (2, True)
    assert run("user", "remove", "bo")[0] == 0
    assert run("user", "remove", "ada")[0] == 0
    with pytest.raises(Refused):
        check_address(anywhere)


def test_the_trail_is_checked_from_the_command_line(run: Run, settings: Settings) -> None:
    import sqlite3

    assert run("token", "add", "a", "--role", "viewer")[0] == 0
    code, out, _ = run("audit", "verify")
    assert code == 0
    assert out.startswith("whole: 1 entries")
    assert run("audit", "verify", "--expect", "0" * 64)[0] == 1
    with sqlite3.connect(settings.database_url.partition(":///")[2]) as books:
        books.execute("UPDATE audit SET who = 'nobody' WHERE sequence = 1")
    code, out, _ = run("audit", "verify")
    assert code == 1
    assert out.startswith("BROKEN")
    assert "entry 1" in out
