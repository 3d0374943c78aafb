"""Files as one zip that is streamed: each file a piece at a time, and at the end a manifest with their hashes."""

import hashlib
import json
import zipfile
from collections.abc import Iterable, Iterator, Mapping
from typing import Any

from bench_service.formats.samples_out.written_bytes import WrittenBytes

MANIFEST = "manifest.json"
BEGIN_OF_ZIP = (1980, 1, 1, 0, 0, 0)


def archived(
    files: Iterable[tuple[str, Iterable[bytes], Mapping[str, Any]]], about: Mapping[str, Any]
) -> Iterator[bytes]:
    """Yield the bytes of a zip. `files`: name, pieces and facts of each; `about` begins the manifest.

    The manifest has name, bytes and SHA-256 of each file besides its facts. Entries are stored without compression
    where their formats compress already, and always with 64-bit sizes, for they are not known before.
    """
    outbox, listed = WrittenBytes(), list[dict[str, Any]]()
    with zipfile.ZipFile(outbox, "w", zipfile.ZIP_DEFLATED, allowZip64=True) as archive:
        for name, pieces, facts in files:
            digest, size = hashlib.sha256(), 0
            entry = zipfile.ZipInfo(name, BEGIN_OF_ZIP)
            entry.compress_type = zipfile.ZIP_DEFLATED if name.endswith((".csv", ".json")) else zipfile.ZIP_STORED
            with archive.open(entry, "w", force_zip64=True) as sink:
                for piece in pieces:
                    digest.update(piece)
                    size += len(piece)
                    sink.write(piece)
                    yield outbox.take()
            listed.append({"file": name, "bytes": size, "sha256": digest.hexdigest(), **facts})
        manifest = json.dumps({**about, "files": listed}, indent=1, ensure_ascii=False, allow_nan=False)
        archive.writestr(zipfile.ZipInfo(MANIFEST, BEGIN_OF_ZIP), manifest + "\n")
        yield outbox.take()
    yield outbox.take()
