"""Recognition of this service's own exports by their metadata, so that a recording can be imported as it was."""

import re
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, BinaryIO

import pyarrow as pa
import pyarrow.parquet as pq

from bench_service.formats.bounds import LINE_BYTES
from bench_service.formats.columnar import is_columnar

_LINE = re.compile(r"^# ([a-z_0-9]+): (.*)$")
_CHANNEL = re.compile(r"^# channel (\S+): quantity=(\S+) unit=(\S+) scale=(\S+) offset=(\S+)$")
MARKS = ("recording", "unit", "rate_hz", "simulated", "content_hash_of_whole_recording")


@dataclass(frozen=True)
class OwnExport:
    """Description that an exported file of this service carries in itself."""

    facts: dict[str, str]
    channels: tuple[dict[str, Any], ...]
    is_text: bool

    @property
    def simulated(self) -> bool:
        """True where the recording was simulated."""
        return self.facts.get("simulated") == "true"

    @property
    def is_whole(self) -> bool:
        """True where the export begins with the recording's first sample."""
        return self.facts.get("first_sample") == "0"

    def description(self) -> dict[str, Any]:
        """Return the import description, as JSON, that brings the recording back as it was."""
        found: dict[str, Any] = {
            "unit": self.facts["unit"],
            "channels": list(self.channels),
            "rate_hz": float(self.facts["rate_hz"]),
            "start_s": float(self.facts.get("start_s", "0")),
            "simulated": self.simulated,
        }
        return found


def own_export(stream: BinaryIO) -> OwnExport | None:
    """Return the description in an export of this service; None: the file is none. The stream is at its beginning
    afterwards.
    """
    try:
        found = _columnar(stream) if is_columnar(stream) else _text(stream)
    except (pa.ArrowException, OSError, UnicodeDecodeError, ValueError, KeyError):
        found = None
    stream.seek(0)
    return found


def _columnar(stream: BinaryIO) -> OwnExport | None:
    stream.seek(0)
    start = stream.read(4)
    stream.seek(0)
    source = pa.PythonFile(stream, mode="r")
    if start == b"PAR1":
        schema = pq.read_schema(source)
    else:
        schema = (pa.ipc.open_file if start == b"ARRO" else pa.ipc.open_stream)(source).schema
    facts = _strings(schema.metadata or {})
    if not all(mark in facts for mark in MARKS):
        return None
    channels = tuple(_channel(field.name, _strings(field.metadata or {})) for field in schema)
    return OwnExport(facts, channels, is_text=False)


def _text(stream: BinaryIO) -> OwnExport | None:
    stream.seek(0)
    if stream.read(2) != b"# ":
        return None
    stream.seek(0)
    facts: dict[str, str] = {}
    channels: list[dict[str, Any]] = []
    for raw in stream.read(LINE_BYTES).split(b"\n"):
        line = raw.decode()
        if not line.startswith("#"):
            break
        if (match := _CHANNEL.match(line)) is not None:
            keys = ("quantity", "unit", "scale", "offset")
            channels.append(_channel(match[1], dict(zip(keys, match.groups()[1:], strict=True))))
        elif (match := _LINE.match(line)) is not None:
            facts[match[1]] = match[2]
    if not channels or not all(mark in facts for mark in MARKS):
        return None
    return OwnExport(facts, tuple(channels), is_text=True)


def _channel(name: str, said: Mapping[str, str]) -> dict[str, Any]:
    return {
        "name": name,
        "quantity": said["quantity"],
        "unit": said["unit"],
        "scale": float(said["scale"]),
        "offset": float(said["offset"]),
    }


def _strings(metadata: Mapping[bytes, bytes]) -> dict[str, str]:
    return {key.decode(): value.decode() for key, value in metadata.items()}
