"""Somebody is told: by mail and by webhook, through a target that is away, never twice, and never as a flood."""

import hashlib
import hmac
import json
import socketserver
import threading
from collections.abc import Callable, Generator, Iterator
from contextlib import contextmanager
from datetime import UTC, datetime, timedelta
from email import message_from_string
from http.server import BaseHTTPRequestHandler, HTTPServer
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest

from bench_service.cli.asking.client import connect
from bench_service.model.errors import Misconfigured, StorageFailure
from bench_service.model.records import BenchStop
from bench_service.notifications.channels import SIGNATURE
from bench_service.notifications.messages import Message
from bench_service.notifications.notifier import Notifier
from bench_service.notifications.outbox import FIRST_PAUSE, OLDEST, Outbox
from bench_service.notifications.targets import Mail, Webhook, read_targets
from bench_service.persistence.bench.host_files import HostFiles
from bench_service.settings import Settings
from bench_service.wall_clock import monotonic_s, now, pause
from procedures.bench import BenchDescription
from tests.kit.supervised_bench import GONE
from tests.service.client import FAST, Client

AT = datetime(2026, 3, 1, 12, tzinfo=UTC)


class _Hook(HTTPServer):
    """A webhook on a loopback port that remembers what it got."""

    def __init__(self) -> None:
        super().__init__(("127.0.0.1", 0), _HookHandler)
        self.got: list[dict] = []
        self.signatures: list[tuple[str | None, bytes]] = []
        self.answers: list[int] = []

    @property
    def url(self) -> str:
        return f"http://127.0.0.1:{self.server_port}/hook"


class _HookHandler(BaseHTTPRequestHandler):
    def do_POST(self) -> None:
        hook = self.server
        assert isinstance(hook, _Hook)
        body = self.rfile.read(int(self.headers["Content-Length"]))
        status = hook.answers.pop(0) if hook.answers else 204
        if status < 300:
            hook.got.append(json.loads(body))
            hook.signatures.append((self.headers[SIGNATURE], body))
        self.send_response(status)
        self.send_header("Content-Length", "0")
        self.end_headers()

    def log_message(self, *args: object) -> None:
        """Say nothing."""


class _MailServer(socketserver.ThreadingTCPServer):
    """As much of an SMTP server (RFC 5321) as a message needs."""

    daemon_threads = True

    def __init__(self) -> None:
        super().__init__(("127.0.0.1", 0), _MailSession)
        self.mails: list[str] = []
        self.recipients: list[str] = []
        self.refuse = ""


class _MailSession(socketserver.StreamRequestHandler):
    def handle(self) -> None:
        server = self.server
        assert isinstance(server, _MailServer)
        self.wfile.write(b"220 test\r\n")
        while line := self.rfile.readline().decode():
            verb = line[:4].upper()
            if verb == "RCPT":
                server.recipients.append(line.strip())
            if verb == "RCPT" and server.refuse:
                self.wfile.write(server.refuse.encode() + b"\r\n")
            elif verb == "DATA":
                self.wfile.write(b"354 go on\r\n")
                lines = []
                while (text := self.rfile.readline().decode()) != ".\r\n":
                    lines.append(text)
                server.mails.append("".join(lines))
                self.wfile.write(b"250 kept\r\n")
            elif verb == "QUIT":
                self.wfile.write(b"221 bye\r\n")
                return
            else:
                self.wfile.write(b"250 ok\r\n")


@contextmanager
def served(server: socketserver.BaseServer) -> Iterator[None]:
    thread = threading.Thread(target=server.serve_forever, kwargs={"poll_interval": 0.05}, daemon=True)
    thread.start()
    try:
        yield
    finally:
        server.shutdown()
        server.server_close()
        thread.join()


@pytest.fixture
def hook() -> Generator[_Hook]:
    made = _Hook()
    with served(made):
        yield made


@pytest.fixture
def mail() -> Generator[_MailServer]:
    made = _MailServer()
    with served(made):
        yield made


def message(key: str = "k", at: datetime = AT, **more: str) -> Message:
    given = {"kind": "verdict", "title": "sim: FAIL", "text": "bias", "bench": "sim", "page": "/jobs/1"} | more
    return Message(key=key, at=at, **given)  # pyright: ignore[reportArgumentType]


def outbox(folder: Path, hook: _Hook, **more: object) -> Outbox:
    target = Webhook.model_validate({"name": "chat", "kind": "webhook", "url": hook.url, **more})
    return Outbox(folder, target, "http://pages")


def test_a_webhook_gets_the_message_once_with_a_signature_of_its_body(tmp_path: Path, hook: _Hook) -> None:
    secret = tmp_path / "secret"
    secret.write_text("s3cret\n")
    box = outbox(tmp_path, hook, secret_file=str(secret))
    for _ in range(3):
        box.put(message())
        assert box.send(AT) == 0
    outbox(tmp_path, hook).put(message())  # a service that starts anew
    assert outbox(tmp_path, hook).send(AT) == 0
    (got,) = hook.got
    assert (got["key"], got["page"], got["at"]) == ("k", "http://pages/jobs/1", AT.isoformat())
    (signature, body) = hook.signatures[0]
    assert signature == "sha256=" + hmac.new(b"s3cret", body, hashlib.sha256).hexdigest()


def test_a_target_that_is_away_is_tried_again_ever_more_slowly_and_loses_nothing(tmp_path: Path, hook: _Hook) -> None:
    hook.answers = [503, 429]
    box = outbox(tmp_path, hook)
    box.put(message("a"))
    box.put(message("b"))
    assert box.send(AT) == 2
    assert box.send(AT + FIRST_PAUSE / 2) == 2
    assert len(hook.answers) == 1, "not before the pause is over"
    assert box.send(AT + FIRST_PAUSE) == 2
    assert box.send(AT + 2 * FIRST_PAUSE) == 2, "the second pause is twice as long"
    assert box.send(AT + 4 * FIRST_PAUSE) == 0
    assert [got["key"] for got in hook.got] == ["a", "b"]


def test_what_waits_outlives_the_process(tmp_path: Path, hook: _Hook) -> None:
    hook.answers = [500]
    box = outbox(tmp_path, hook)
    box.put(message())
    assert box.send(AT) == 1
    assert outbox(tmp_path, hook).send(AT) == 0
    assert len(hook.got) == 1


@pytest.mark.parametrize(("status", "later"), [(410, timedelta()), (503, OLDEST + timedelta(seconds=1))])
def test_a_message_is_given_up_where_it_is_refused_for_good_or_too_old(
    tmp_path: Path, hook: _Hook, status: int, later: timedelta, caplog: pytest.LogCaptureFixture
) -> None:
    hook.answers = [status]
    box = outbox(tmp_path, hook)
    box.put(message())
    assert box.send(AT + later) == 0
    assert hook.got == []
    assert "not tried again" in caplog.text


def test_a_flood_becomes_a_digest(tmp_path: Path, hook: _Hook) -> None:
    box = outbox(tmp_path, hook, per_hour=3)
    for number in range(10):
        box.put(message(f"m{number}", title=f"title {number}"))
    assert box.send(AT) == 0
    assert [got["title"] for got in hook.got] == [
        "title 0",
        "title 1",
        "sim: 8 messages in one, because the hourly limit was reached",
    ]
    assert all(f"title {number}" in hook.got[2]["text"] for number in range(2, 10))
    box.put(message("late"))
    assert box.send(AT + timedelta(minutes=59)) == 1
    assert box.send(AT + timedelta(minutes=61)) == 0


@pytest.mark.parametrize("kind", ["stop", "prompt"])
def test_a_flood_holds_back_neither_stops_nor_prompts(tmp_path: Path, hook: _Hook, kind: str) -> None:
    box = outbox(tmp_path, hook, per_hour=2)
    for number in range(10):
        box.put(message(f"m{number}"))
    assert box.send(AT) == 0
    box.put(message("waits"))
    for number in range(5):  # more than the hour has room for, and each by itself
        box.put(message(f"now{number}", kind=kind, title=f"title {number}"))
    assert box.send(AT) == 1
    assert [got["title"] for got in hook.got[2:]] == [f"title {number}" for number in range(5)]
    assert outbox(tmp_path, hook, per_hour=2).send(AT) == 0, "a service that starts anew has an hour of its own"
    assert hook.got[-1]["key"] == "waits"


def test_a_stop_is_tried_at_once_at_a_target_that_was_away(tmp_path: Path, hook: _Hook) -> None:
    hook.answers = [503] * 6
    box = outbox(tmp_path, hook)
    box.put(message("verdict"))
    at = AT
    for _ in range(6):  # the pause is minutes by now
        assert box.send(at) == 1
        at = box._due
    at -= timedelta(seconds=1)
    assert box.send(at) == 1
    box.put(message("stop", kind="stop"))
    assert box.send(at) == 0
    assert [got["key"] for got in hook.got] == ["stop", "verdict"]


def test_a_target_gets_the_events_that_it_asked_for(tmp_path: Path, hook: _Hook) -> None:
    box = outbox(tmp_path, hook, events=["stop"])
    box.put(message())
    box.put(message("s", kind="stop"))
    assert box.send(AT) == 0
    assert [got["kind"] for got in hook.got] == ["stop"]


def test_a_mail_has_subject_text_and_the_address_of_the_page(tmp_path: Path, mail: _MailServer) -> None:
    given = {"name": "shift", "kind": "smtp", "host": "127.0.0.1", "port": mail.server_address[1], "security": "none"}
    target = Mail.model_validate({**given, "sender": "bench@lab.example", "to": ["a@lab.example", "b@lab.example"]})
    box = Outbox(tmp_path, target, "http://pages")
    box.put(message(title="sim: FAIL калібрування\nBcc: evil@example", text="зміщення 0.1 deg/h"))
    assert box.send(AT) == 0
    (text,) = mail.mails
    read = message_from_string(text)
    assert read["Bcc"] is None, "a title adds no header"
    body = read.get_payload(decode=True)
    assert isinstance(body, bytes)
    assert "зміщення 0.1 deg/h" in body.decode()
    assert "http://pages/jobs/1" in body.decode()
    assert len(mail.recipients) == 2
    mail.refuse = "451 later"
    box.put(message("again"))
    assert box.send(AT) == 1
    mail.refuse = "550 no such person"
    assert box.send(AT + FIRST_PAUSE) == 0


@pytest.mark.parametrize(
    ("text", "named"),
    [
        ("", "target"),
        ("target = 3", "target"),
        ('[[target]]\nname = "x"\nkind = "webhook"\nurl = "ftp://a"', "url"),
        ('[[target]]\nname = "x"\nkind = "webhook"\nurl = "http://a"\nsecret_file = "/nowhere"', "/nowhere"),
        ('[[target]]\nname = "x"\nkind = "smtp"\nhost = "h"\nsender = "a@b"\nto = ["no address"]', "to"),
        ("no toml", "cannot be read"),
    ],
)
def test_a_file_that_cannot_be_used_is_refused_with_the_field(tmp_path: Path, text: str, named: str) -> None:
    file = tmp_path / "notify.toml"
    file.write_text(text)
    with pytest.raises(Misconfigured, match=named):
        read_targets(file)


def kinds(hook: _Hook) -> list[str]:
    return [got["kind"] for got in hook.got]


def until(true: Callable[[], bool]) -> None:
    deadline = monotonic_s() + 30.0
    while not true():
        assert monotonic_s() < deadline
        pause(0.05)


def test_a_silent_supervisor_is_told_of_where_the_database_is_away(
    tmp_path: Path, hook: _Hook, monkeypatch: pytest.MonkeyPatch
) -> None:
    def away(_: str) -> tuple[BenchStop, ...]:
        raise StorageFailure("the database is away")

    monkeypatch.setattr(HostFiles, "silent_supervisor", lambda _: GONE.process)
    stores: Any = SimpleNamespace(
        jobs=SimpleNamespace(on_event=lambda _: None), benches=SimpleNamespace(standing_stops=away)
    )
    box = outbox(tmp_path, hook)
    notifier = Notifier("sim", stores, [box], lambda: None, 0, HostFiles(tmp_path, "sim"))
    with pytest.raises(StorageFailure):
        notifier._look()
    box.send(now())
    assert kinds(hook) == ["trouble"]


def test_a_bench_tells_of_verdicts_prompts_failed_nights_stops_and_a_silent_supervisor(
    tmp_path: Path, hook: _Hook, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(HostFiles, "silent_supervisor", lambda _: GONE.process)
    due = "the certificate AT-1 of the turntable expires soon: it is valid until 2031-01-02"
    monkeypatch.setattr(BenchDescription, "due_between", lambda *_: (due,))
    file = tmp_path / "notify.toml"
    file.write_text(f'[[target]]\nname = "chat"\nkind = "webhook"\nurl = "{hook.url}"\n')
    url = f"sqlite:///{tmp_path / 'bench.sqlite'}"
    with connect(Settings(database_url=url, notify=file, ask_operator=True), None, drive=True) as http:
        client = Client(http)
        job = client.wait(client.submit(seed=8)["id"])
        legs = [{"target_c": target, "ramp_c_min": 5.0, "least_s": 600.0} for target in (30.0, 25.0, 20.0)]
        asks = client.submit("thermal_cycle", parameters={"legs": legs, "power_off_s": 60.0})
        until(lambda: "prompt" in kinds(hook))
        silent = [got["text"] for got in hook.got if got["title"] == "sim: its supervisor is silent"]
        assert len(silent) == 1
        assert f'<p class="warning">T{due[1:]}.</p>' in http.get("/").text
        assert silent[0].startswith("The supervisor, process 1 on nowhere, gives no heartbeat")
        http.post(f"/api/v1/jobs/{asks['id']}/cancel")
        client.wait(asks["id"])
        steps = [{"name": "verify", "procedure": "calibration_12_orientations", "parameters": FAST}]
        assert http.post("/api/v1/campaigns", json={"name": "night", "steps": steps}).is_success
        assert http.post("/api/v1/campaigns/night/runs", json={"unit": "SIM-0001", "seed": 8}).is_success
        until(lambda: "campaign" in kinds(hook))
        stop = http.post("/api/v1/benches/sim/stop", json={"reason": "smoke", "by": "Olena"}).json()["stop"]
        until(lambda: "stop" in kinds(hook))
    told = {got["kind"]: got for got in hook.got}
    first = next(got for got in hook.got if got["kind"] == "verdict")
    assert first["title"] == f"sim: {job['verdict'].upper()} {job['procedure']} on SIM-0001"
    assert first["page"] == f"/jobs/{job['id']}"
    assert told["prompt"]["page"] == f"/jobs/{asks['id']}"
    assert told["campaign"]["title"] == "sim: FAIL campaign night on SIM-0001"
    assert "limit" in told["campaign"]["text"] or "=" in told["campaign"]["text"]
    assert told["stop"]["key"] == f"stop-{stop}"
    assert "Olena: smoke" in told["stop"]["text"]
    assert sorted(kinds(hook)) == ["campaign", "certificate", "prompt", "stop", "trouble", "verdict", "verdict"]
    assert told["certificate"]["title"] == f"sim: {due}"
