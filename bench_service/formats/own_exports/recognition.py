"""Recognition of this service's own exports by their metadata, in every format that has a place for it."""

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, BinaryIO

import pyarrow as pa
import pyarrow.parquet as pq

from bench_service.formats.bounds import LINE_BYTES, Bounds
from bench_service.formats.columnar import is_columnar
from bench_service.formats.errors import UnreadableFile
from bench_service.formats.joined_files import Opened
from bench_service.formats.logs.table import SelfDescribing
from bench_service.formats.logs.zipped import Zipped
from bench_service.formats.own_exports.model import MARKS, OwnExport
from bench_service.formats.samples_out.distinct_names import distinct
from bench_service.formats.samples_out.naming import SIMULATED
from bench_service.formats.samples_out.sheet import TIME
from bench_service.formats.text_source import TextSource

_LINE = re.compile(r"^# ([a-z_0-9]+): (.*)$")
_CHANNEL = re.compile(r"^# channel (\S+): quantity=(\S+) unit=(\S+) scale=(\S+) offset=(\S+)$")
_SAID = ("quantity", "unit", "scale", "offset")


@dataclass(frozen=True)
class Provenance:
    """Statements of an import's files about their origin, which count more than a person's description."""

    simulated: bool
    origin: str | None
    exports: tuple[dict[str, Any], ...]
    """File, and the facts of the export that it is, of each file that is one."""
    warnings: tuple[str, ...]


def provenance(opened: Sequence[Opened]) -> Provenance:
    """Return what files say of their origin, by their metadata or their names."""
    simulated, origin = False, None
    exports: list[dict[str, Any]] = []
    warnings: list[str] = []
    for one in opened:
        name, own = one.file.name, own_export(one)
        if own is not None:
            exports.append({"file": name, **own.kept})
            origin = own.origin or origin
            warnings += [f"{name}: {words}" for words in own.cautions()]
        if (own is not None and own.simulated) or is_named_simulated(one):
            simulated = True
            warnings.append(f"{name} is an export of a simulated recording: what comes of it stays marked as simulated")
    return Provenance(simulated, origin, tuple(exports), tuple(warnings))


def is_named_simulated(opened: Opened) -> bool:
    """Return whether the name of a file, or of one in a zip, says that samples are simulated, as our exports' do."""
    members = opened.log.members if isinstance(opened.log, Zipped) else ()
    return any(SIMULATED.search(name) for name in (opened.file.name, *members))


def own_export(opened: Opened) -> OwnExport | None:
    """Return what an export of this service says of itself; None: the file is none. A stream that is read here is at
    its beginning afterwards.
    """
    if opened.log is not None:
        log = opened.log
        return _stated(log.facts, log.column_facts) if isinstance(log, SelfDescribing) else None
    stream = opened.file.stream
    try:
        found = _columnar(stream) if is_columnar(stream) else _text(stream, opened.file.name)
    except (pa.ArrowException, OSError, UnicodeDecodeError, ValueError, KeyError, UnreadableFile):
        found = None
    stream.seek(0)
    return found


def _stated(facts: Mapping[str, str], columns: Mapping[str, Mapping[str, str]]) -> OwnExport | None:
    if not all(mark in facts for mark in MARKS):
        return None
    try:
        channels = tuple(_channel(name, said) for name, said in columns.items() if _is_channel(said))
    except (ValueError, KeyError):
        channels = ()
    order = facts.get("channels_of_whole_recording", "").split(",")  # files of HDF5 have none
    places = {name: place for place, name in enumerate(order)}
    return OwnExport(dict(facts), tuple(sorted(channels, key=lambda c: places.get(c["name"], len(places)))))


def _columnar(stream: BinaryIO) -> OwnExport | None:
    stream.seek(0)
    start = stream.read(4)
    stream.seek(0)
    source = pa.PythonFile(stream, mode="r")
    if start == b"PAR1":
        schema = pq.read_schema(source)
    else:
        schema = (pa.ipc.open_file if start == b"ARRO" else pa.ipc.open_stream)(source).schema
    return _stated(_strings(schema.metadata or {}), {field.name: _strings(field.metadata or {}) for field in schema})


def _text(stream: BinaryIO, name: str) -> OwnExport | None:
    """Statements of the comments that begin a text, plain, packed, or in UTF-16."""
    source = TextSource(stream, name, Bounds().unpacked_bytes)
    source.fill(LINE_BYTES)
    facts: dict[str, str] = {}
    said: list[tuple[str, dict[str, str]]] = []
    for raw in source.glance()[:LINE_BYTES].split(b"\n"):
        line = raw.decode().rstrip("\r")
        if not line.startswith("#"):
            break
        if (match := _CHANNEL.match(line)) is not None:
            said.append((match[1], dict(zip(_SAID, match.groups()[1:], strict=True))))
        elif (match := _LINE.match(line)) is not None:
            facts[match[1]] = match[2]
    if not said:
        return None
    columns = distinct([TIME.name, *(channel for channel, _ in said)])[1:]
    return _stated(facts, {column: {"channel": name, **of} for column, (name, of) in zip(columns, said, strict=True)})


def _is_channel(said: Mapping[str, str]) -> bool:
    """Return whether a column is that of a channel: a time is none, and older files name no channel but its scale."""
    return "quantity" in said and "unit" in said and ("channel" in said or "scale" in said)


def _channel(column: str, said: Mapping[str, str]) -> dict[str, Any]:
    name = said.get("channel", column)
    found: dict[str, Any] = {"name": name} if name == column else {"name": name, "column": column}
    return {
        **found,
        "quantity": said["quantity"],
        "unit": said["unit"],
        "scale": float(said.get("scale", "1")),
        "offset": float(said.get("offset", "0")),
    }


def _strings(metadata: Mapping[bytes, bytes]) -> dict[str, str]:
    return {key.decode(): value.decode() for key, value in metadata.items()}
