"""Typesetting of a printed report as PDF/A-3b by typst, with the fonts that matplotlib ships.

Nothing is fetched: typst gets a folder of its own with the layout, the data, the figures and the attached files.
"""

import json
import os
import unicodedata
from collections.abc import Generator, Sequence
from contextlib import contextmanager, suppress
from dataclasses import replace
from functools import lru_cache
from importlib.resources import files
from pathlib import Path
from shutil import rmtree
from tempfile import TemporaryDirectory, gettempdir
from textwrap import wrap
from typing import Any

from bench_service.formats.printed.document import (
    Attachment,
    Block,
    Facts,
    Heading,
    Paragraph,
    PrintedDocument,
    PrintedTable,
)
from bench_service.formats.printed.drawing import drawn_here
from procedures.core.report import Figure

STANDARD = "a-3b"
FONT = "DejaVuSans.ttf"
LAYOUT = "report.typ"
FOLDER = "bench-report-"
"""Beginning of the names of temporary folders; the id of their process follows."""
WIDTH_PT, INSET_PT = 498.0, 6.0
"""Width of a page's text, and the margins of a table's cell, as the layout has them [pt]."""
LETTER_EM = 0.62
"""Width of a letter of the font, of digits and lower case, relative to its size."""
SMALLEST_PT, LARGEST_PT = 4.5, 7.5
LONG = 40
"""Length from which a cell is a text that may break."""


def typeset(document: PrintedDocument) -> bytes:
    """Return the document as a PDF/A-3b file; equal documents give equal bytes. Takes about a second; writes temporary
    files.
    """
    import typst  # 80 MB that only a process that prints loads

    with _folder(document) as folder:
        return typst.compile(
            str(folder / LAYOUT),
            root=str(folder),
            format="pdf",
            pdf_standards=[STANDARD],
            font_paths=[str(_fonts())],
            ignore_system_fonts=True,
            timestamp=int(document.at.timestamp()),
        )


def _fonts() -> Path:
    import matplotlib as mpl

    return Path(mpl.get_data_path()) / "fonts" / "ttf"


@lru_cache(maxsize=1)
def _drawable() -> frozenset[int]:
    """Code points that the report's font can draw."""
    from matplotlib.ft2font import FT2Font

    return frozenset(FT2Font(str(_fonts() / FONT)).get_charmap())


def printable(text: str) -> str:
    """Return a text with each character that the font lacks, or that a PDF/A may not hold, written as its code
    point.
    """
    return "".join(c if c == "\n" or _fits(c) else "" if _silent(c) else f"[U+{ord(c):04X}]" for c in text)


def _fits(character: str) -> bool:
    return ord(character) in _drawable() and unicodedata.category(character)[0] != "C"


def _silent(character: str) -> bool:
    """Control and format characters, which show nothing anyway."""
    return unicodedata.category(character) in ("Cc", "Cf")


@contextmanager
def _folder(document: PrintedDocument) -> Generator[Path]:
    """A folder with everything that the layout reads."""
    with TemporaryDirectory(prefix=f"{FOLDER}{os.getpid()}-") as name:
        folder = Path(name)
        (folder / LAYOUT).write_bytes((files("bench_service.formats.printed") / LAYOUT).read_bytes())
        data = {
            "title": printable(document.title),
            "subject": printable(document.subject),
            "verdict": printable(document.verdict),
            "identifier": printable(document.identifier),
            "at": list(document.at.timetuple()[:6]),
            "blocks": [_block(folder, number, block) for number, block in enumerate(document.blocks)],
            "attachments": [_attachment(folder, number, one) for number, one in enumerate(document.attachments)],
        }
        (folder / "report.json").write_text(json.dumps(data, ensure_ascii=False), encoding="utf-8")
        yield folder


def remove_orphaned_folders() -> None:
    """Remove the folders of processes that were killed while they printed; those of this user alone."""
    for folder in Path(gettempdir()).glob(f"{FOLDER}*-*"):
        with suppress(OSError, ValueError):
            if folder.stat().st_uid == os.getuid() and not _alive(int(folder.name[len(FOLDER) :].partition("-")[0])):
                rmtree(folder, ignore_errors=True)


def _alive(pid: int) -> bool:
    try:
        os.kill(pid, 0)
    except ProcessLookupError:
        return False
    except PermissionError:
        return True
    return True


def _block(folder: Path, number: int, block: Block) -> dict[str, Any]:
    match block:
        case Heading(text):
            return {"kind": "heading", "text": printable(text)}
        case Paragraph(text, warning):
            return {"kind": "paragraph", "text": printable(text), "warning": warning}
        case Facts(rows):
            return {"kind": "facts", "rows": [[printable(cell) for cell in row] for row in rows]}
        case PrintedTable():
            return {
                "kind": "table",
                "title": printable(block.title),
                "columns": [printable(column) for column in _headers(block)],
                "rows": [[printable(cell) for cell in row] for row in block.rows],
                "numeric": list(block.numeric),
                "size": _size(block),
                "note": printable(block.note),
            }
        case Figure():
            image, figure = f"figure-{number}.svg", _drawable_figure(block)
            (folder / image).write_text(drawn_here(figure), encoding="utf-8")
            return {"kind": "figure", "image": image, "title": figure.title, "note": figure.note}


def _letters(table: PrintedTable) -> list[int]:
    """Letters that each column needs so that its cells stay in one line: long texts may break.

    Headers break between words too, but only where they would make the letters of the table smaller.
    """
    columns = range(len(table.columns))
    cells = [max((min(len(row[i]), LONG) for row in table.rows), default=0) for i in columns]
    whole = [max(cells[i], min(len(table.columns[i]), LONG)) for i in columns]
    if _fitting(whole) >= LARGEST_PT:
        return whole
    return [max(cells[i], *(len(word) for word in table.columns[i].split() or [""])) for i in columns]


def _headers(table: PrintedTable) -> list[str]:
    """Headers broken between words where they are wider than their columns."""
    return ["\n".join(wrap(name, max(n, 1))) for name, n in zip(table.columns, _letters(table), strict=True)]


def _size(table: PrintedTable) -> float:
    """Size of a table's letters [pt] at which its rows fit the page without a break."""
    return round(min(LARGEST_PT, max(SMALLEST_PT, _fitting(_letters(table)))), 2)


def _fitting(letters: Sequence[int]) -> float:
    """Size [pt] at which columns of so many letters fill the page's width."""
    return (WIDTH_PT - INSET_PT * len(letters)) / (LETTER_EM * max(sum(letters), 1))


def _drawable_figure(figure: Figure) -> Figure:
    """The figure with texts that the font can draw."""
    words = {name: printable(getattr(figure, name)) for name in ("title", "x_label", "y_label", "note")}
    return replace(figure, **words, series=tuple(replace(s, name=printable(s.name)) for s in figure.series))


def _attachment(folder: Path, number: int, one: Attachment) -> dict[str, Any]:
    path = f"attached-{number}"
    (folder / path).write_bytes(one.data)
    return {
        "path": path,
        "name": one.name,
        "media_type": one.media_type,
        "relation": one.relation.lower(),
        "description": printable(one.description),
    }
