"""The documents of the project as tests read them: pages, blocks of commands with their marks, texts of the code."""

import re
from dataclasses import dataclass
from functools import cache
from pathlib import Path

from tests.kit.source_facts import ROOT, facts

PAGES = (ROOT / "README.md", ROOT / "client" / "README.md", *sorted((ROOT / "docs").glob("*.md")))
PACKAGES = ("procedures", "simulators", "bench_service")
_MARK = re.compile(r"<!-- (run|checked|not run): ((?:(?!-->).)+) -->\s*\Z")
_FENCE = re.compile(r"^```(\w*)\n(.*?)^```$", re.DOTALL | re.MULTILINE)
_INDENTED = re.compile(r"(?:(?<=\n\n)|(?<=-->\n))(?: {4}.*\n)(?:(?: {4}.*)?\n)*")


@dataclass(frozen=True)
class Block:
    """A block of a page with the mark before it: kind "run", "checked" or "not run", and its text; "" for none."""

    page: Path
    language: str
    text: str
    kind: str
    why: str

    def __str__(self) -> str:
        return f"{self.page.relative_to(ROOT)}: {self.text.splitlines()[0][:60]}"


def blocks(page: Path) -> list[Block]:
    """Fenced and indented blocks of a page, in order; fenced ones of language "text" are pictures and left out."""
    text = page.read_text(encoding="utf-8") + "\n"
    found: list[tuple[int, str, str]] = [(m.start(), m[1], m[2]) for m in _FENCE.finditer(text) if m[1] != "text"]
    bare = _FENCE.sub(lambda m: re.sub(r"[^\n]", "#", m[0]), text)
    found += [(m.start(), "", m[0]) for m in _INDENTED.finditer(bare) if not _of_a_list(bare, m.start())]
    marked = []
    for start, language, body in sorted(found):
        mark = _MARK.search(text[max(0, start - 400) : start])
        marked.append(Block(page, language, body, *(mark.groups() if mark else ("", ""))))
    return marked


def _of_a_list(text: str, start: int) -> bool:
    """True where an indented piece continues an entry of a list."""
    before = text[:start].rstrip("\n").splitlines()
    return bool(before) and re.match(r"\s*([*-]|\d+\.)\s|\s+\S", before[-1]) is not None


@cache
def texts_of_code() -> str:
    """All string constants of the three packages, of the first check and of the client, a line each."""
    files = [p for package in (*PACKAGES, "client/bench_client") for p in (ROOT / package).rglob("*.py")]
    return "\n".join(text for path in (*files, ROOT / ".preflight.py") for text in facts(path).texts)


def docstrings(path: Path) -> tuple[tuple[str, str], ...]:
    """Name and text of every docstring of a file, also those of fields, in one line each."""
    return facts(path).docstrings
