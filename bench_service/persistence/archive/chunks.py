"""Names and bytes of archived chunks. A chunk is a Parquet file already: its bytes go to the archive as they are."""

import hashlib

from bench_service.model.errors import DamagedRecording
from bench_service.persistence.archive.places import place_at


def chunk_name(recording_id: str, number: int) -> str:
    """Return the name of a chunk's file in the dataset; readers of such datasets take the recording's id from the
    folder.
    """
    return f"samples/recording={recording_id}/chunk-{number:06d}.parquet"


def archived_chunk(place: str, recording_id: str, number: int, sha256: str) -> bytes:
    """Return the bytes of a chunk from the archive. Raises `ArchiveAway`, and `DamagedRecording` where they do not
    match the hash.
    """
    name = chunk_name(recording_id, number)
    payload = place_at(place).read(name)
    if hashlib.sha256(payload).hexdigest() != sha256:
        raise DamagedRecording(
            f"chunk {number} of recording {recording_id} is damaged in the archive ({place}: {name}): its bytes do not "
            "have the hash they were stored with; a copy of the archive has them"
        )
    return payload
