"""Reading and writing of files for commands."""

import os
from collections.abc import Generator
from contextlib import contextmanager
from pathlib import Path
from typing import BinaryIO

from bench_service.cli.processes.private_files import mode_of_exports
from bench_service.cli.refusal import Refused


def text_of(file: Path) -> str:
    """Return the content of a text file. Raises `Refused` where it cannot be read or is not UTF-8."""
    try:
        return file.read_text(encoding="utf-8")
    except UnicodeDecodeError as error:
        raise Refused(f"{file} is not UTF-8 text: {error.reason} at byte {error.start}") from error


def check_folder(file: Path) -> None:
    """Check that the folder of a file exists, before there is anything to lose. Raises `Refused` where it does not."""
    if not file.absolute().parent.is_dir():
        raise Refused(f"{file} cannot be written: there is no folder {file.parent}")


def clear_place(file: Path) -> None:
    """Remove a file that an earlier command left, so that it is not taken for this one's. Raises `Refused`."""
    check_folder(file)
    try:
        if file.exists() and not file.is_file():
            raise Refused(f"{file} cannot be written: it is not an ordinary file")
        file.unlink(missing_ok=True)
    except OSError as error:
        raise Refused(f"an old {file} cannot be removed: {error.strerror}") from error


@contextmanager
def whole_file(file: Path) -> Generator[BinaryIO]:
    """A file to write that is there at the end of the block, and not at all where that fails: a CI system may be
    reading. Raises `Refused`.
    """
    partial = file.with_name(file.name + ".part")
    try:
        try:
            with partial.open("wb") as sink:
                os.fchmod(sink.fileno(), mode_of_exports())
                yield sink
            partial.replace(file)
        finally:
            partial.unlink(missing_ok=True)
    except OSError as error:
        raise Refused(f"{file} cannot be written: {error.strerror}") from error
