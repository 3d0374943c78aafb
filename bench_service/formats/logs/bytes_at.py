"""Reading of exact numbers of bytes from a stream, with the place in the message where the file ends too early."""

from typing import BinaryIO

from bench_service.formats.errors import UnreadableFile


def exactly(stream: BinaryIO, size: int, name: str, wanted: str) -> bytes:
    """Read and return `size` bytes. Raises `UnreadableFile` naming the byte where the file is cut off, and what was
    `wanted`.
    """
    at = stream.tell()
    data = stream.read(size)
    if len(data) < size:
        raise UnreadableFile(
            name, f"is cut off at byte {at + len(data)}: {wanted} from byte {at} on needs {size} bytes"
        )
    return data


def size_of(stream: BinaryIO) -> int:
    """Return the length of the file; the place in it stays."""
    at = stream.tell()
    end = stream.seek(0, 2)
    stream.seek(at)
    return end
