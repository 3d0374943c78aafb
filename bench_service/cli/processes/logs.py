"""Destination and format of log lines: one handler for the service's, the HTTP server's and the job engine's.

`BENCH_LOG=json` writes one JSON object a line with what it is about as fields; without it, text for a person.
"""

import logging
import re
import sys
from datetime import UTC, datetime
from logging.handlers import RotatingFileHandler

from bench_service.model.errors import Misconfigured
from bench_service.settings import Settings
from bench_service.telemetry.log_context import AddSubjects
from bench_service.telemetry.log_restraint import Restraint
from bench_service.telemetry.redaction import without_tokens

FIELDS = "{asctime} {levelname} {name} {message}"
OWN_HANDLERS = ("uvicorn", "uvicorn.error", "uvicorn.access", "dbos")
"""Loggers of libraries that install a handler of their own unless they find one; some put tracebacks into messages."""


FILE_BYTES, FILES_KEPT = 10_000_000, 5
"""Length at which a log file is rotated, and number of older ones that are kept."""
TRACE = "    | "
"""Prefix of each line of a traceback: a message with a line break in it cannot look like a line of the log."""
_CONTROL = re.compile(r"[\x00-\x1f\x7f-\x9f\u061c\u200e\u200f\u2028-\u202e\u2066-\u2069]")
"""Control characters, line separators of Unicode, and marks that change the direction of what follows."""


def visible(text: str) -> str:
    """Return a text with its control characters escaped, so that it stays one line and commands no terminal, and with
    tokens hidden.
    """
    return _CONTROL.sub(lambda found: ascii(found[0])[1:-1], without_tokens(text))


class Lines(logging.Formatter):
    """Formatter of log records as one line for a person; a traceback follows on marked lines of its own."""

    def format(self, record: logging.LogRecord) -> str:
        about: dict[str, str] = getattr(record, "subjects", {})
        found = " ".join(f"{name}={value}" for name, value in about.items())
        message = record.getMessage()
        first, *more = message.split("\n") if record.name in OWN_HANDLERS else [message]
        text = f"{_moment(record)} {record.levelname:7} {record.name}: {first}"
        if found:
            text += f" [{found}]"
        if record.exc_info:  # asyncio gives False where there is none
            more += self.formatException(record.exc_info).split("\n")
        return "\n".join([visible(text), *(TRACE + visible(line) for line in more)])


def set_up(settings: Settings, level: str) -> None:
    """Write this service's lines of at least this level to standard error, or to the settings' log file.

    "This service's" are those of `bench_service` and `procedures`; of other packages warnings and errors are written.

    The setting `log_level` counts more than `level`, where given. Raises `Misconfigured` for a file that cannot be
    written.
    """
    handler = _handler(settings)
    handler.addFilter(Restraint())
    handler.addFilter(AddSubjects(bench=settings.bench_id))
    handler.setFormatter(_json_lines() if settings.log == "json" else Lines())
    wanted = (settings.log_level or level).upper()
    root = logging.getLogger()
    for old in root.handlers[:]:
        if isinstance(old, logging.StreamHandler) and any(isinstance(f, AddSubjects) for f in old.filters):
            root.removeHandler(old)
            if isinstance(old, RotatingFileHandler):
                old.close()
    root.addHandler(handler)
    root.setLevel(logging.WARNING)
    logging.getLogger("bench_service").setLevel(wanted)
    logging.getLogger("procedures").setLevel(wanted)
    for name in OWN_HANDLERS:
        logger = logging.getLogger(name)
        logger.handlers = [handler]
        logger.propagate = False
    logging.getLogger("uvicorn").setLevel(logging.WARNING)
    logging.getLogger("uvicorn.access").setLevel(logging.INFO if settings.log_access else logging.WARNING)
    logging.getLogger("uvicorn.error").setLevel("INFO" if wanted == "DEBUG" else logging.WARNING)


def _handler(settings: Settings) -> logging.Handler:
    if settings.log_file is None:
        return logging.StreamHandler(sys.stderr)
    try:
        settings.log_file.parent.mkdir(parents=True, exist_ok=True)
        handler = RotatingFileHandler(settings.log_file, maxBytes=FILE_BYTES, backupCount=FILES_KEPT, encoding="utf-8")
        settings.log_file.chmod(0o600)  # begun before the service takes rights away from what it makes
        return handler
    except OSError as error:
        raise Misconfigured(f"BENCH_LOG_FILE {settings.log_file} cannot be written: {error.strerror}") from error


def _json_lines() -> logging.Formatter:
    from pythonjsonlogger.json import JsonFormatter

    class JsonLines(JsonFormatter):
        """Log lines as JSON: the record's own fields, and time, level, logger and message."""

        def format(self, record: logging.LogRecord) -> str:
            return _CONTROL.sub(lambda found: f"\\u{ord(found[0]):04x}", without_tokens(super().format(record)))

        def process_log_record(self, log_data: dict[str, object]) -> dict[str, object]:
            about = log_data.pop("subjects", None)
            return {**log_data, **(about if isinstance(about, dict) else {})}

        def formatTime(self, record: logging.LogRecord, datefmt: str | None = None) -> str:  # noqa: N802  inherited
            return _moment(record)

    renamed = {"asctime": "at", "levelname": "level", "name": "logger"}
    return JsonLines(FIELDS, style="{", rename_fields=renamed, reserved_attrs=_reserved(), json_ensure_ascii=False)


def _reserved() -> list[str]:
    """Attributes of every record that are no news; `subjects` is not among them."""
    return [*vars(logging.makeLogRecord({})), "asctime", "message", "color_message", "taskName"]


def _moment(record: logging.LogRecord) -> str:
    at = datetime.fromtimestamp(record.created, UTC)
    return at.isoformat(timespec="milliseconds").replace("+00:00", "Z")
